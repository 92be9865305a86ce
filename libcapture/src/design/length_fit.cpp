#include "length_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lumihull::capture::design {
namespace {

constexpr double kUnknown = 0.3;      // m or rad: a guess says more than observations that tell less than this
constexpr double kGaugeSigma = 1e-5;  // m: tight beside what is measured, loose beside rounding
constexpr double kGainUnit = 0.1;     // a gain's change that matters as much as a metre: ten metres of cable
constexpr double kReject = 4;         // times the usual size of a pose's residuals
constexpr double kUsual = 0.9442;     // sqrt(median of chi-square with 6 degrees / 6)
constexpr double kLeastScale = 1e-2;  // of the expected noise: below, rounding would be judged

struct Weighted {
  std::vector<Eigen::MatrixXd> whitening;  // inverse Cholesky factors of the residuals' covariances
  std::vector<double> weights;
};

class Solver {
 public:
  Solver(const LengthLayout& layout, const LengthParameters& start, std::span<const LengthObservation> observations,
         double length_sigma_m)
      : layout_(layout), observations_(observations), length_sigma_(length_sigma_m), reference_(start.attachments) {
    scale_.setOnes(layout.size());
    for (int i = 0; layout.gains && i < layout.cables; ++i) scale_[layout.gain(i)] = kGainUnit;
    // The two motions of the platform's frame that change no length: along z, and about z.
    gauge_.setZero(2, layout.size());
    for (int p = 0; p < layout.points; ++p) {
      const Eigen::Vector3d& b = reference_[std::size_t(p)];
      gauge_.block<1, 3>(0, layout.attachment(p)) << 0, 0, 1;
      gauge_.block<1, 3>(1, layout.attachment(p)) << -b.y(), b.x(), 0;
    }
    for (int k = 0; k < 2; ++k) gauge_.row(k).normalize();
  }

  /// Residuals of each observation over their expected size: sqrt(rᵀ S⁻¹ r / cables).
  std::vector<double> sizes(const LengthParameters& x, Weighted& w) const {
    std::vector<double> out;
    w.whitening.clear();
    for (const LengthObservation& o : observations_) {
      Eigen::MatrixXd pose;
      const Eigen::VectorXd r = length_residuals(layout_, x, o, nullptr, &pose);
      Eigen::MatrixXd s = pose * o.covariance * pose.transpose();
      s.diagonal().array() += length_sigma_ * length_sigma_;
      const Eigen::LLT<Eigen::MatrixXd> llt(s);
      w.whitening.push_back(llt.matrixL().solve(Eigen::MatrixXd::Identity(layout_.cables, layout_.cables)));
      out.push_back((w.whitening.back() * r).norm() / std::sqrt(double(layout_.cables)));
    }
    return out;
  }

  double cost(const LengthParameters& x, const Weighted& w) const {
    double sum = gauge_residuals(x).squaredNorm();
    for (std::size_t k = 0; k < observations_.size(); ++k)
      if (w.weights[k] > 0)
        sum += w.weights[k] *
               (w.whitening[k] * length_residuals(layout_, x, observations_[k], nullptr, nullptr)).squaredNorm();
    return sum;
  }

  /// Normal equations in natural units, decomposed.
  void linearise(const LengthParameters& x, const Weighted& w) {
    Eigen::MatrixXd h = gauge_.transpose() * gauge_ / (kGaugeSigma * kGaugeSigma);
    Eigen::VectorXd g = gauge_.transpose() * gauge_residuals(x) / kGaugeSigma;
    Eigen::MatrixXd jacobian;
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      if (!(w.weights[k] > 0)) continue;
      const Eigen::VectorXd r = w.whitening[k] * length_residuals(layout_, x, observations_[k], &jacobian, nullptr);
      const Eigen::MatrixXd j = w.whitening[k] * jacobian;
      h.selfadjointView<Eigen::Lower>().rankUpdate(j.transpose(), w.weights[k]);
      g += w.weights[k] * (j.transpose() * r);
    }
    h = Eigen::MatrixXd(h.selfadjointView<Eigen::Lower>());
    eigen_.compute(scale_.asDiagonal() * h * scale_.asDiagonal());
    gradient_ = eigen_.eigenvectors().transpose() * scale_.cwiseProduct(g);
  }

  bool known(int direction) const { return eigen_.eigenvalues()[direction] > 1 / (kUnknown * kUnknown); }

  Eigen::VectorXd step(double damping) const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(layout_.size());
    for (int d = 0; d < layout_.size(); ++d)
      if (known(d)) y[d] = -gradient_[d] / (eigen_.eigenvalues()[d] + damping);
    return scale_.cwiseProduct(eigen_.eigenvectors() * y);
  }

  Eigen::MatrixXd covariance() const {
    Eigen::VectorXd variances = Eigen::VectorXd::Zero(layout_.size());
    for (int d = 0; d < layout_.size(); ++d)
      if (known(d)) variances[d] = 1 / eigen_.eigenvalues()[d];
    const Eigen::MatrixXd v = scale_.asDiagonal() * eigen_.eigenvectors();
    return v * variances.asDiagonal() * v.transpose();
  }

  std::vector<Eigen::VectorXd> unknown() const {
    std::vector<Eigen::VectorXd> out;
    for (int d = 0; d < layout_.size(); ++d)
      if (!known(d)) out.emplace_back(eigen_.eigenvectors().col(d));
    return out;
  }

  /// Steps until they are tiny. `reweigh` sets weights from the sizes of residuals before each.
  template <class Reweigh>
  void minimise(LengthParameters& x, Weighted& w, const Reweigh& reweigh) {
    double damping = 1e-3, factor = 2;
    for (int iteration = 0; iteration < 200; ++iteration) {
      reweigh(sizes(x, w), w.weights);
      linearise(x, w);
      const double before = cost(x, w), largest = eigen_.eigenvalues().maxCoeff();
      bool moved = false;
      for (int attempt = 0; attempt < 12 && !moved; ++attempt) {
        const Eigen::VectorXd change = step(damping * largest * 1e-6);
        if (!(change.cwiseAbs().maxCoeff() > 1e-11)) return;
        const LengthParameters next = x.moved(layout_, change);
        if (cost(next, w) < before) {
          x = next, moved = true;
          damping = std::max(damping / 10, 1e-12), factor = 2;
        } else {
          damping *= factor, factor *= 2;
        }
      }
      if (!moved) return;
    }
  }

 private:
  Eigen::Vector2d gauge_residuals(const LengthParameters& x) const {
    Eigen::Vector2d out = Eigen::Vector2d::Zero();
    for (int p = 0; p < layout_.points; ++p)
      out +=
          gauge_.block<2, 3>(0, layout_.attachment(p)) * (x.attachments[std::size_t(p)] - reference_[std::size_t(p)]);
    return out / kGaugeSigma;
  }

  const LengthLayout& layout_;
  std::span<const LengthObservation> observations_;
  double length_sigma_;
  std::vector<Eigen::Vector3d> reference_;
  Eigen::VectorXd scale_, gradient_;
  Eigen::Matrix<double, 2, Eigen::Dynamic> gauge_;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;
};

double usual_size(std::vector<double> sizes) {
  const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(*middle / kUsual, kLeastScale);
}

}  // namespace

LengthFit fit_lengths(const LengthLayout& layout, const LengthParameters& start,
                      std::span<const LengthObservation> observations, double length_sigma_m) {
  Solver solver(layout, start, observations, length_sigma_m);
  LengthFit fit;
  fit.parameters = start;
  Weighted w;
  // First with weights that fall off (Geman & McClure 1985), at a scale that shrinks as the fit settles …
  solver.minimise(fit.parameters, w, [](const std::vector<double>& sizes, std::vector<double>& weights) {
    const double reach = 3 * usual_size(sizes);
    weights.clear();
    for (const double s : sizes) weights.push_back(std::pow(1 + (s / reach) * (s / reach), -2));
  });
  // … then all or nothing, until the same observations stay out.
  std::vector<double> keep;
  for (int round = 0; round < 10; ++round) {
    const std::vector<double> sizes = solver.sizes(fit.parameters, w);
    const double limit = kReject * usual_size(sizes);
    std::vector<double> now;
    for (const double s : sizes) now.push_back(s <= limit ? 1 : 0);
    if (now == keep) break;
    keep = now;
    solver.minimise(fit.parameters, w,
                    [&](const std::vector<double>&, std::vector<double>& weights) { weights = keep; });
  }
  w.weights = keep;
  const std::vector<double> sizes = solver.sizes(fit.parameters, w);
  solver.linearise(fit.parameters, w);
  fit.covariance = solver.covariance();
  fit.unobservable = solver.unknown();

  double squares = 0, whitened = 0, count = 0;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    if (!(keep[k] > 0)) {
      fit.rejected.push_back(k);
      continue;
    }
    squares += length_residuals(layout, fit.parameters, observations[k], nullptr, nullptr).squaredNorm();
    whitened += sizes[k] * sizes[k] * layout.cables;
    count += layout.cables;
  }
  fit.rms_m = std::sqrt(squares / std::max(1.0, count));
  const double freedom = count - (layout.size() - 2 - double(fit.unobservable.size()));
  fit.sigma0 = freedom > 0 ? std::sqrt(whitened / freedom) : 0;
  return fit;
}

}  // namespace lumihull::capture::design
