#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "factorization.h"

namespace lumihull::slf {
namespace {

/// x ← x * numerator / denominator. Where the denominator is 0 so is the numerator: no sample depends on x. Numbers on
/// their way to 0 are taken there before they get slow.
void multiply(Eigen::MatrixXd& x, const Eigen::MatrixXd& numerator, const Eigen::MatrixXd& denominator) {
  x.array() = (denominator.array() > 0).select(x.array() * numerator.array() / denominator.array(), 0.0);
  x.array() = (x.array() > 1e-100).select(x.array(), 0.0);
}

}  // namespace

Factors nmf(const Eigen::Ref<const Eigen::MatrixXf>& a, int terms, const NmfOptions& options, std::uint64_t seed,
            std::vector<double>* loss) {
  factor::require_matrix(a);
  factor::require_terms(terms);
  factor::require_number(options.tolerance, "tolerance");
  if (options.iterations < 0) factor::fail("iterations: expected a number >= 0");
  if (options.weights) factor::require_weights(*options.weights, a);
  const Eigen::Index n = a.rows(), m = a.cols();
  const Eigen::MatrixXf w = options.weights ? *options.weights : Eigen::MatrixXf::Ones(n, m).eval();
  Eigen::MatrixXd x = factor::samples(a, w);
  if (x.minCoeff() < 0) factor::fail("expected a matrix of numbers >= 0");
  // Of unit size inside: squares neither vanish nor overflow.
  const double scale = x.maxCoeff() > 0 ? x.maxCoeff() : 1, heaviest = w.maxCoeff() > 0 ? double(w.maxCoeff()) : 1;
  x /= scale;
  const Eigen::MatrixXd weight = w.cast<double>() / heaviest, wx = weight.cwiseProduct(x);

  const double mean = std::sqrt(x.mean() / terms);
  Eigen::MatrixXd g(n, terms), h(terms, m);
  for (Eigen::Index i = 0; i < g.size(); ++i) g.data()[i] = mean * (0.5 + factor::uniform(seed));
  for (Eigen::Index i = 0; i < h.size(); ++i) h.data()[i] = mean * (0.5 + factor::uniform(seed));
  Eigen::MatrixXd product = g * h, numerator, denominator;
  const auto sum_of_squares = [&] { return (weight.array() * (x - product).array().square()).sum(); };
  double now = sum_of_squares();
  if (loss) loss->assign(1, now * scale * scale * heaviest);
  for (int i = 0; i < options.iterations && now > 0; ++i) {
    product.array() *= weight.array();
    numerator.noalias() = wx * h.transpose();
    denominator.noalias() = product * h.transpose();
    multiply(g, numerator, denominator);
    product.noalias() = g * h;
    product.array() *= weight.array();
    numerator.noalias() = g.transpose() * wx;
    denominator.noalias() = g.transpose() * product;
    multiply(h, numerator, denominator);
    product.noalias() = g * h;
    const double before = std::exchange(now, sum_of_squares());
    if (loss) loss->push_back(now * scale * scale * heaviest);
    if (before - now <= options.tolerance * before) break;
  }
  // Without samples nothing was learnt; the updates say so only if there was one.
  for (Eigen::Index i = 0; i < n; ++i)
    if (wx.row(i).isZero(0)) g.row(i).setZero();
  for (Eigen::Index j = 0; j < m; ++j)
    if (wx.col(j).isZero(0)) h.col(j).setZero();

  Factors out{Eigen::MatrixXf::Zero(n, terms), Eigen::MatrixXf::Zero(terms, m)};
  std::vector<int> order(static_cast<std::size_t>(terms));
  std::iota(order.begin(), order.end(), 0);
  Eigen::VectorXd energy(terms);
  for (int k = 0; k < terms; ++k) energy[k] = g.col(k).norm() * h.row(k).norm();
  std::stable_sort(order.begin(), order.end(), [&](int p, int q) { return energy[p] > energy[q]; });
  for (int k = 0; k < terms; ++k) {
    const int from = order[std::size_t(k)];
    if (!(energy[from] > 0)) continue;
    const double length = h.row(from).norm();
    out.surface.col(k) = (scale * length * g.col(from)).cast<float>();
    out.view.row(k) = (h.row(from) / length).cast<float>();
  }
  return out;
}

}  // namespace lumihull::slf
