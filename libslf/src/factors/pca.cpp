#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "factorization.h"

namespace lumihull::slf {
namespace {

constexpr int kGuards = 6;           // vectors beyond the wanted ones: their gap decides the speed
constexpr int kIterations = 300;     // a guard against no end; far fewer are used
constexpr double kResidual = 1e-13;  // |C v - θ v| at which a pair is found, against the largest eigenvalue
constexpr double kVanishing = 1e-7;  // σ_k / σ_1: what rounding to float leaves of an exact zero
constexpr int kMaxDegree = 12;       // of the filter
constexpr double kMaxSpread = 13.8;  // ln 1e6: how differently one filter may amplify two wanted vectors

/// Degree of the filter for wanted Ritz values between `lowest` and `highest`, damping [0, cut]. A polynomial that
/// amplifies the first far more than the last would drown the last in the rounding of the first.
int filter_degree(double highest, double lowest, double cut) {
  const auto growth = [&](double value) { return std::acosh(std::max(2 * value / cut - 1, 1.0)); };
  const double spread = growth(highest) - growth(lowest);
  return spread * kMaxDegree <= kMaxSpread ? kMaxDegree : std::max(1, int(kMaxSpread / spread));
}

/// The eigenvectors (s x count) of the `count` largest eigenvalues, 0 where those vanish, of the symmetric positive
/// semidefinite C (s x s): orthogonal iteration with Rayleigh-Ritz, each step a Chebyshev polynomial of C instead of C
/// (Zhou, Saad, Tiago & Chelikowsky 2006), and Hotelling's deflation of the leading pairs once they are found, which
/// lets the polynomial's degree rise.
Eigen::MatrixXd largest_eigenvectors(Eigen::MatrixXd c, Eigen::Index count, std::uint64_t seed) {
  const Eigen::Index s = c.rows();
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(s, count);
  const Eigen::Index width = std::min(s, count + kGuards);
  Eigen::MatrixXd v(s, width), cv, previous, next;
  for (Eigen::Index i = 0; i < v.size(); ++i) v.data()[i] = factor::uniform(seed) - 0.5;
  v = c * v;

  Eigen::Index done = 0;
  double largest = 0;
  for (int iteration = 0; done < count; ++iteration) {
    factor::orthonormalize(v);
    cv.noalias() = c * v;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz(v.transpose() * cv);
    const Eigen::VectorXd theta = ritz.eigenvalues().reverse();
    const Eigen::MatrixXd turn = ritz.eigenvectors().rowwise().reverse();
    v = (v * turn).eval();
    cv = (cv * turn).eval();
    largest = std::max(largest, theta[0]);

    // Leading pairs that are found; at the last iteration all are taken as they are.
    Eigen::Index ready = 0;
    while (done + ready < count && ((cv.col(ready) - theta[ready] * v.col(ready)).norm() <= kResidual * largest ||
                                    iteration == kIterations || width == s))
      ++ready;
    for (Eigen::Index k = 0; k < ready; ++k, ++done) {
      if (theta[k] <= kVanishing * kVanishing * largest) return found;  // the rest is zero
      found.col(done) = v.col(k);
      c.noalias() -= theta[k] * v.col(k) * v.col(k).transpose();
    }
    if (done == count) break;
    if (ready > 0) {  // those are gone from C: fewer columns, as many guards
      v = v.rightCols(v.cols() - ready).eval();
      cv = cv.rightCols(cv.cols() - ready).eval();
    }
    const double cut = theta[theta.size() - 1];
    if (cut <= kVanishing * kVanishing * largest) {
      v.swap(cv);
      continue;
    }
    const int degree = filter_degree(theta[ready], theta[ready + count - done - 1], cut);
    // T_0 = 1, T_1 = x, T_d+1 = 2 x T_d - T_d-1 with x = 2 C / cut - 1.
    previous = v;
    v = (2 / cut) * cv - v;
    for (int d = 1; d < degree; ++d) {
      next.noalias() = c * v;
      next = (4 / cut) * next - 2 * v - previous;
      previous.swap(v);
      v.swap(next);
    }
  }
  return found;
}

}  // namespace

Factors pca(const Eigen::Ref<const Eigen::MatrixXf>& a, int terms, std::uint64_t seed) {
  factor::require_matrix(a);
  factor::require_terms(terms);
  for (Eigen::Index j = 0; j < a.cols(); ++j)
    for (Eigen::Index i = 0; i < a.rows(); ++i) factor::require_sample(a(i, j));
  const Eigen::Index n = a.rows(), m = a.cols(), rank = std::min<Eigen::Index>(terms, std::min(n, m));
  Eigen::MatrixXd surface = Eigen::MatrixXd::Zero(n, terms), view = Eigen::MatrixXd::Zero(m, terms);
  const double scale = a.cwiseAbs().maxCoeff();  // squares neither vanish nor overflow
  if (scale > 0) {
    const Eigen::MatrixXd x = a.cast<double>() / scale;
    const bool tall = n >= m;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(std::min(n, m), std::min(n, m));
    if (tall)
      gram.selfadjointView<Eigen::Lower>().rankUpdate(x.transpose());
    else
      gram.selfadjointView<Eigen::Lower>().rankUpdate(x);
    gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
    const Eigen::MatrixXd vectors = largest_eigenvectors(std::move(gram), rank, seed);
    // Aᵀ turns left singular vectors into right ones; where their values are small, less exactly orthogonal.
    if (tall)
      view.leftCols(rank) = vectors;
    else
      view.leftCols(rank).noalias() = x.transpose() * vectors;
    factor::orthonormalize(view);
    surface.noalias() = scale * (x * view);
  }
  return factor::signed_factors(std::move(surface), std::move(view));
}

}  // namespace lumihull::slf
