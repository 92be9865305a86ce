#include "cma_es.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "random.h"

namespace lumihull::capture::design {
namespace {

/// Weights and rates that depend on the population alone (tutorial, table 1).
struct Rates {
  Rates(int n, int lambda) : weights(lambda / 2) {
    const int mu = lambda / 2;
    for (int i = 0; i < mu; ++i) weights[i] = std::log(0.5 * (lambda + 1)) - std::log(i + 1.0);
    weights /= weights.sum();
    mu_eff = 1 / weights.squaredNorm();
    c_sigma = (mu_eff + 2) / (n + mu_eff + 5);
    d_sigma = 1 + 2 * std::max(0.0, std::sqrt((mu_eff - 1) / (n + 1)) - 1) + c_sigma;
    c_c = (4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n);
    c_1 = 2 / ((n + 1.3) * (n + 1.3) + mu_eff);
    c_mu = std::min(1 - c_1, 2 * (mu_eff - 2 + 1 / mu_eff) / ((n + 2.0) * (n + 2.0) + mu_eff));
    chi = std::sqrt(double(n)) * (1 - 1 / (4.0 * n) + 1 / (21.0 * n * n));
  }

  Eigen::VectorXd weights;
  double mu_eff, c_sigma, d_sigma, c_c, c_1, c_mu, chi;
};

/// One descent, until it stalls or `evaluations` is reached.
class Descent {
 public:
  Descent(const CmaOptions& options, int lambda, Random& random)
      : n_(options.dimensions), lambda_(lambda), rates_(n_, lambda), random_(random), sigma_(options.first_sigma) {
    mean_.resize(n_);
    for (int i = 0; i < n_; ++i) mean_[i] = random.uniform();
    path_sigma_.setZero(n_), path_c_.setZero(n_);
    covariance_.setIdentity(n_, n_), axes_.setIdentity(n_, n_), lengths_.setOnes(n_);
  }

  const Eigen::MatrixXd& sample() {
    steps_.resize(n_, lambda_), points_.resize(n_, lambda_);
    for (int k = 0; k < lambda_; ++k)
      for (int i = 0; i < n_; ++i) steps_(i, k) = random_.normal();
    steps_ = axes_ * lengths_.asDiagonal() * steps_;
    points_ = (sigma_ * steps_).colwise() + mean_;
    return points_;
  }

  /// Order: best first. Equal values in the order of sampling.
  void update(const std::vector<int>& order) {
    ++generation_;
    const int mu = int(rates_.weights.size());
    Eigen::MatrixXd chosen(n_, mu);
    for (int i = 0; i < mu; ++i) chosen.col(i) = steps_.col(order[std::size_t(i)]);
    const Eigen::VectorXd step = chosen * rates_.weights;
    mean_ += sigma_ * step;
    const Eigen::VectorXd whitened = axes_ * (axes_.transpose() * step).cwiseQuotient(lengths_);
    const double c = rates_.c_sigma;
    path_sigma_ = (1 - c) * path_sigma_ + std::sqrt(c * (2 - c) * rates_.mu_eff) * whitened;
    const double length = path_sigma_.norm() / std::sqrt(1 - std::pow(1 - c, 2.0 * generation_));
    const bool h = length < (1.4 + 2.0 / (n_ + 1)) * rates_.chi;
    const double cc = rates_.c_c;
    path_c_ *= 1 - cc;
    if (h) path_c_ += std::sqrt(cc * (2 - cc) * rates_.mu_eff) * step;
    covariance_ *= 1 - rates_.c_1 - rates_.c_mu + (h ? 0 : rates_.c_1 * cc * (2 - cc));
    covariance_ += rates_.c_1 * path_c_ * path_c_.transpose() +
                   rates_.c_mu * chosen * rates_.weights.asDiagonal() * chosen.transpose();
    sigma_ *= std::exp(std::min(1.0, c / rates_.d_sigma * (path_sigma_.norm() / rates_.chi - 1)));
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance_);
    axes_ = eigen.eigenvectors();
    lengths_ = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  }

  bool exhausted() const {
    return !(lengths_.minCoeff() > 1e-7 * lengths_.maxCoeff()) || !(sigma_ * lengths_.maxCoeff() > 1e-7) ||
           !(sigma_ < 1e4);
  }

 private:
  int n_, lambda_;
  Rates rates_;
  Random& random_;
  double sigma_;
  int generation_ = 0;
  Eigen::VectorXd mean_, path_sigma_, path_c_, lengths_;
  Eigen::MatrixXd covariance_, axes_, steps_, points_;
};

}  // namespace

CmaResult cma_es(const CmaOptions& options, const std::function<double(const Eigen::VectorXd&)>& f, Job& job,
                 const std::string& stage) {
  Random random(options.seed);
  CmaResult best;
  best.value = std::numeric_limits<double>::infinity();
  const int n = options.dimensions;
  int lambda = 4 + int(3 * std::log(double(n)));
  job.begin(stage, options.evaluations);
  while (best.evaluations < options.evaluations && !(best.value <= options.target)) {
    Descent descent(options, lambda, random);
    const int patience = 20 + 30 * n / lambda;
    double best_here = std::numeric_limits<double>::infinity();
    int since = 0;
    while (best.evaluations < options.evaluations && !(best.value <= options.target) && since < patience &&
           !descent.exhausted()) {
      const Eigen::MatrixXd& points = descent.sample();
      std::vector<double> values(std::size_t(lambda), 0);
      parallel_for(
          job, values.size(),
          [&](std::size_t k) {
            const double value = f(points.col(Eigen::Index(k)));
            values[k] = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
          },
          true);
      best.evaluations += values.size();
      std::vector<int> order(values.size());
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(),
                       [&](int a, int b) { return values[std::size_t(a)] < values[std::size_t(b)]; });
      const double now = values[std::size_t(order[0])];
      if (now < best.value || best.x.size() == 0) best.value = now, best.x = points.col(order[0]);
      since = now < best_here ? 0 : since + 1;
      best_here = std::min(best_here, now);
      descent.update(order);
    }
    lambda *= 2;
    ++best.restarts;
  }
  --best.restarts;
  job.end();
  return best;
}

}  // namespace lumihull::capture::design
