// Weighted low-rank approximation by variable projection. X = G Hᵀ with G: n x K (surface), H: m x K (view). With W the
// weights and L the smoothness times its strength, the loss is
//   f = Σ w (a - x)² + ridge (|G|² + |H|²) + Σ_i x_i L x_iᵀ.
// Row i of the best G for a given H is g_i = M_i⁻¹ Hᵀ (w_i a_i), M_i = Hᵀ (diag w_i + L) H + ridge; f is then a
// function of H. Its Gauss-Newton matrix (Kaufman's: without the derivative of M_i⁻¹) maps a change D of H to
//   ridge D + Σ_i (diag w_i + L) (D - H M_i⁻¹ Hᵀ (diag w_i + L) D) g_iᵀ g_i
// and is never formed: its sums over samples are products of W with thin matrices of K² columns, as
//   Σ_j w_ij h_jk u_ij = Σ_l g_il Σ_j w_ij (h_jk d_jl)   for u = G Dᵀ.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "factorization.h"

namespace lumihull::slf {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kLeastRidge = 1e-10;  // what "no ridge" means: the limit of smallest norm
constexpr double kExact = 1e-14;       // share of Σ w a² that rounding the samples to float leaves over
constexpr double kWorthwhile = 0.5;    // while a term is young, iterate only as long as the loss falls below this share
constexpr int kYoungSteps = 20;        // at most
constexpr double kWeakRidge = 5e-4;    // below it, young terms may run away
constexpr double kStrongRidge = 1e-2, kFading = 0.1;
constexpr int kPowerSteps = 12;  // for a new term's direction: a start, no more
constexpr int kConjugateSteps = 60;
constexpr double kConjugateResidual = 0.03;  // of a Gauss-Newton step, against its gradient
constexpr double kPositive = 1e-6;           // of a smoothness: how far below 0 float may have put its eigenvalues

Index packed(Index k, Index l) { return k * (k + 1) / 2 + l; }

/// Many K x K systems at once: row i of `systems` is the packed lower triangle of the i-th matrix, which its Cholesky
/// factor replaces, with the diagonal inverted. A pivot that vanishes takes its unknown out: it becomes 0.
void factor_systems(MatrixXd& systems, Index terms) {
  for (Index k = 0; k < terms; ++k)
    for (Index l = 0; l <= k; ++l) {
      auto x = systems.col(packed(k, l)).array();
      if (l < k) {
        for (Index p = 0; p < l; ++p) x -= systems.col(packed(k, p)).array() * systems.col(packed(l, p)).array();
        x *= systems.col(packed(l, l)).array();
      } else {
        const VectorXd before = x;
        for (Index p = 0; p < k; ++p) x -= systems.col(packed(k, p)).array().square();
        x = (x > 1e-14 * before.array()).select(x.rsqrt(), 0.0);
      }
    }
}

/// Row i of `right` (rows x K) is replaced by the solution of the i-th system.
void solve_systems(const MatrixXd& systems, MatrixXd& right) {
  const Index terms = right.cols();
  for (Index k = 0; k < terms; ++k) {
    for (Index p = 0; p < k; ++p) right.col(k).array() -= systems.col(packed(k, p)).array() * right.col(p).array();
    right.col(k).array() *= systems.col(packed(k, k)).array();
  }
  for (Index k = terms; k-- > 0;) {
    for (Index p = k + 1; p < terms; ++p)
      right.col(k).array() -= systems.col(packed(p, k)).array() * right.col(p).array();
    right.col(k).array() *= systems.col(packed(k, k)).array();
  }
}

/// Row i: the packed products of row i of x with itself.
void pairs(const MatrixXd& x, MatrixXd& out) {
  out.resize(x.rows(), packed(x.cols(), 0));
  for (Index k = 0; k < x.cols(); ++k)
    for (Index l = 0; l <= k; ++l) out.col(packed(k, l)) = x.col(k).cwiseProduct(x.col(l));
}

/// Row i: all products x_ik y_il, at k K + l.
void products(const MatrixXd& x, const MatrixXd& y, MatrixXd& out) {
  out.resize(x.rows(), x.cols() * y.cols());
  for (Index k = 0; k < x.cols(); ++k)
    for (Index l = 0; l < y.cols(); ++l) out.col(k * y.cols() + l) = x.col(k).cwiseProduct(y.col(l));
}

class Fit {
 public:
  /// a: 0 where w is; both scaled to sizes near 1. smoothness: strength L, or empty.
  Fit(MatrixXd a, MatrixXd w, double ridge, MatrixXd smoothness)
      : a_(std::move(a)),
        w_(std::move(w)),
        wa_(w_.cwiseProduct(a_)),
        ridge_(ridge),
        l_(std::move(smoothness)),
        exact_(kExact * a_.cwiseProduct(wa_).sum()) {
    now_.h.resize(a_.cols(), 0);
    evaluate(now_);
  }

  bool exact() const { return now_.misfit <= exact_; }
  double loss() const { return now_.loss; }

  void set_ridge(double ridge) {
    ridge_ = ridge;
    evaluate(now_);
  }

  /// Appends the direction in which the loss falls most steeply. False where there is none.
  bool add_term(std::uint64_t& seed) {
    MatrixXd slope = now_.residual;
    if (now_.h.cols() > 0 && l_.size() > 0) slope.noalias() -= now_.g * now_.lh.transpose();
    VectorXd v(a_.cols()), u;
    for (double& x : v) x = factor::uniform(seed) - 0.5;
    for (int i = 0; i < kPowerSteps; ++i) {
      u.noalias() = slope * v;
      v.noalias() = slope.transpose() * u;
      const double length = v.norm();
      if (!(length > 0)) return false;
      v /= length;
    }
    u.noalias() = slope * v;
    const Index k = now_.h.cols();
    now_.h.conservativeResize(Eigen::NoChange, k + 1);
    now_.h.col(k) = std::sqrt(u.norm()) * v;  // as the balanced factors of a term are
    evaluate(now_);
    return true;
  }

  /// Gauss-Newton with Marquardt's damping, until an iteration takes less than `least` of the loss off.
  void refine(int iterations, double least) {
    for (int i = 0; i < iterations && !exact(); ++i) {
      linearise();
      const double before = now_.loss;
      for (int attempt = 0;; ++attempt) {
        step();
        trial_.h = now_.h + change_;
        evaluate(trial_);
        if (trial_.loss < before) break;
        if (attempt == 6) return;
        damping_ *= 10;
      }
      std::swap(now_, trial_);
      balance();
      damping_ = std::max(damping_ / 10, 1e-6);
      if (before - now_.loss <= least * before) return;
    }
  }

  const MatrixXd& surface() const { return now_.g; }
  const MatrixXd& view() const { return now_.h; }

 private:
  struct Point {
    MatrixXd g, h;                // n x K, m x K
    MatrixXd lh;                  // L H
    MatrixXd systems;             // factors of M_i, a row each
    MatrixXd residual;            // w (a - x)
    double misfit = 0, loss = 0;  // Σ w (a - x)²; with the penalties
  };

  /// The rest of a point from its h.
  void evaluate(Point& p) {
    const Index terms = p.h.cols();
    small_ = MatrixXd::Zero(terms, terms);  // Hᵀ L H
    if (l_.size() > 0) {
      p.lh.noalias() = l_ * p.h;
      small_.noalias() = p.h.transpose() * p.lh;
    }
    pairs(p.h, thin_);
    p.systems.noalias() = w_ * thin_;
    for (Index k = 0; k < terms; ++k)
      for (Index l = 0; l <= k; ++l) p.systems.col(packed(k, l)).array() += small_(k, l) + (k == l ? ridge_ : 0);
    factor_systems(p.systems, terms);
    p.g.noalias() = wa_ * p.h;
    solve_systems(p.systems, p.g);
    p.residual = a_;
    p.residual.noalias() -= p.g * p.h.transpose();
    p.misfit = 0;
    for (Index j = 0; j < a_.cols(); ++j) {
      const VectorXd& d = column_ = p.residual.col(j);
      p.residual.col(j) = w_.col(j).cwiseProduct(d);
      p.misfit += d.dot(p.residual.col(j));
    }
    p.loss = p.misfit + ridge_ * (p.g.squaredNorm() + p.h.squaredNorm());
    if (l_.size() > 0) p.loss += (p.g.transpose() * p.g).cwiseProduct(small_).sum();
  }

  /// The same product from factors of equal scale, axis by axis: those of least |G|² + |H|². Gauss-Newton would take
  /// long to find them, for in these directions the product does not change.
  void balance() {
    MatrixXd& q = trial_.h = now_.h;
    factor::orthonormalize(q);
    const MatrixXd coordinates = q.transpose() * now_.h;  // H = q coordinates
    gram_.noalias() = now_.g.transpose() * now_.g;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(coordinates * gram_ * coordinates.transpose());
    const VectorXd length = axes.eigenvalues().cwiseMax(0).cwiseSqrt().cwiseSqrt();
    now_.h.noalias() = q * (axes.eigenvectors() * length.asDiagonal());
    evaluate(now_);
  }

  /// Half the gradient by H, and the blocks on the diagonal (what alternation would solve for each view).
  void linearise() {
    const Index terms = now_.h.cols();
    gram_.noalias() = now_.g.transpose() * now_.g;
    gradient_ = ridge_ * now_.h;
    if (l_.size() > 0) gradient_.noalias() += now_.lh * gram_;
    gradient_.noalias() -= now_.residual.transpose() * now_.g;
    pairs(now_.g, thin_);
    blocks_.noalias() = w_.transpose() * thin_;
    for (Index k = 0; k < terms; ++k)
      for (Index l = 0; l <= k; ++l) {
        if (k == l) blocks_.col(packed(k, l)).array() += ridge_;
        if (l_.size() > 0) blocks_.col(packed(k, l)) += gram_(k, l) * l_.diagonal();
      }
    preconditioner_ = blocks_;
    factor_systems(preconditioner_, terms);
  }

  /// out = (Gauss-Newton matrix + damping * diagonal blocks) d.
  void apply(const MatrixXd& d, MatrixXd& out) {
    const Index terms = d.cols();
    products(now_.h, d, thin_);
    wide_.noalias() = w_ * thin_;
    v_ = MatrixXd::Zero(now_.g.rows(), terms);
    if (l_.size() > 0) {
      small_.noalias() = d.transpose() * now_.lh;
      v_.noalias() = now_.g * small_;
    }
    for (Index k = 0; k < terms; ++k)
      for (Index l = 0; l < terms; ++l) v_.col(k) += now_.g.col(l).cwiseProduct(wide_.col(k * terms + l));
    solve_systems(now_.systems, v_);
    products(now_.g, v_, wide_);
    thin_.noalias() = w_.transpose() * wide_;
    out = MatrixXd::Zero(d.rows(), terms);
    if (l_.size() > 0) {
      small_.noalias() = v_.transpose() * now_.g;
      ld_.noalias() = l_ * d;
      out.noalias() = ld_ * gram_;
      out.noalias() -= now_.lh * small_;
    }
    for (Index k = 0; k < terms; ++k)
      for (Index l = 0; l < terms; ++l) {
        const Index b = k > l ? packed(k, l) : packed(l, k);
        auto y = out.col(k).array();
        y += (1 + damping_) * blocks_.col(b).array() * d.col(l).array();
        // The blocks hold L's diagonal already, which `ld_ gram_` has, too.
        if (l_.size() > 0) y -= gram_(k, l) * l_.diagonal().array() * d.col(l).array();
        y -= now_.h.col(l).array() * thin_.col(k * terms + l).array();
      }
  }

  /// change_ = the damped step, by conjugate gradients, preconditioned by the blocks.
  void step() {
    change_ = MatrixXd::Zero(now_.h.rows(), now_.h.cols());
    r_ = -gradient_;
    z_ = r_;
    solve_systems(preconditioner_, z_);
    p_ = z_;
    double rz = r_.cwiseProduct(z_).sum();
    const double enough = kConjugateResidual * kConjugateResidual * rz;
    for (int i = 0; i < kConjugateSteps && rz > enough; ++i) {
      apply(p_, q_);
      const double curvature = p_.cwiseProduct(q_).sum();
      if (!(curvature > 0)) break;
      const double alpha = rz / curvature;
      change_ += alpha * p_;
      r_ -= alpha * q_;
      z_ = r_;
      solve_systems(preconditioner_, z_);
      const double next = r_.cwiseProduct(z_).sum();
      p_ = z_ + (next / rz) * p_;
      rz = next;
    }
  }

  MatrixXd a_, w_, wa_;
  double ridge_;
  MatrixXd l_;
  double exact_;
  double damping_ = 1e-2;
  Point now_, trial_;
  MatrixXd gram_, gradient_, blocks_, preconditioner_, change_;
  MatrixXd thin_, wide_, small_, ld_, v_, r_, z_, p_, q_;
  VectorXd column_;
};

/// strength * the matrix that the caller gave, checked.
MatrixXd checked_smoothness(const LowRankOptions& options, Index m) {
  if (!options.smoothness || options.strength == 0) return {};
  const Eigen::MatrixXf& l = *options.smoothness;
  const std::string size = std::to_string(m) + " x " + std::to_string(m);
  if (l.rows() != m || l.cols() != m) factor::fail("smoothness: expected a matrix of " + size);
  if (!l.allFinite()) factor::fail("smoothness: expected finite numbers");
  MatrixXd x = l.cast<double>();
  const double most = x.cwiseAbs().maxCoeff();
  if (most == 0) return {};
  if ((x - x.transpose()).cwiseAbs().maxCoeff() > kPositive * most)
    factor::fail("smoothness: expected a symmetric matrix");
  x = (0.5 * (x + x.transpose())).eval();
  if (((x / most).eval() + double(m) * kPositive * MatrixXd::Identity(m, m)).llt().info() != Eigen::Success)
    factor::fail("smoothness: expected a positive semidefinite matrix");
  return options.strength * x;
}

}  // namespace

Factors low_rank(const Eigen::Ref<const Eigen::MatrixXf>& a, const Eigen::Ref<const Eigen::MatrixXf>& weights,
                 int terms, const LowRankOptions& options, std::uint64_t seed) {
  factor::require_matrix(a);
  factor::require_terms(terms);
  factor::require_weights(weights, a);
  factor::require_number(options.ridge, "ridge");
  factor::require_number(options.tolerance, "tolerance");
  factor::require_number(options.strength, "strength");
  if (options.iterations < 0) factor::fail("iterations: expected a number >= 0");
  const Index n = a.rows(), m = a.cols(), rank = std::min<Index>(terms, std::min(n, m));
  MatrixXd smoothness = checked_smoothness(options, m), x = factor::samples(a, weights), w = weights.cast<double>();

  MatrixXd surface = MatrixXd::Zero(n, terms), view = MatrixXd::Zero(m, terms);
  const double scale = x.cwiseAbs().maxCoeff();
  if (scale > 0) {
    w *= double((w.array() > 0).count()) / w.sum();
    x /= scale;
    const double size = std::sqrt(w.cwiseProduct(x).cwiseProduct(x).sum() * double(n) * double(m) / w.sum());
    const double ridge = std::max(options.ridge, kLeastRidge) * size, strong = kStrongRidge * size;
    const auto grow = [&](Fit& f) {
      for (Index k = 0; k < rank && !f.exact() && f.add_term(seed); ++k)
        if (k + 1 < rank) f.refine(std::min(options.iterations, kYoungSteps), 1 - kWorthwhile);
    };
    Fit fit(x, w, ridge, smoothness);
    grow(fit);
    fit.refine(options.iterations, options.tolerance);
    // A weak ridge lets rows with few samples run away while terms are young. Where the samples are not met, the same
    // again from a strong ridge, which then fades.
    if (ridge < kWeakRidge * size && !fit.exact()) {
      Fit calm(std::move(x), std::move(w), strong, std::move(smoothness));
      grow(calm);
      for (double r = strong; r > ridge; r *= kFading) {
        calm.refine(std::min(options.iterations, kYoungSteps), 1 - kWorthwhile);
        calm.set_ridge(std::max(r * kFading, ridge));
      }
      calm.refine(options.iterations, options.tolerance);
      if (calm.loss() < fit.loss()) fit = std::move(calm);
    }
    // Principal axes of the product: the view orthonormal, the surface orthogonal.
    MatrixXd q = fit.view();
    factor::orthonormalize(q);
    const MatrixXd g = fit.surface() * (fit.view().transpose() * q);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(g.transpose() * g);
    const VectorXd energy = axes.eigenvalues().reverse();
    const MatrixXd turn = axes.eigenvectors().rowwise().reverse();
    for (Index k = 0; k < energy.size() && energy[k] > kExact * energy[0]; ++k) {
      surface.col(k) = scale * (g * turn.col(k));
      view.col(k) = q * turn.col(k);
    }
  }
  return factor::signed_factors(std::move(surface), std::move(view));
}

}  // namespace lumihull::slf
