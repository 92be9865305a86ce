#include "factorization.h"

#include <cmath>

namespace lumihull::slf::factor {
namespace {

std::string shape(const Matrix& a) { return std::to_string(a.rows()) + " x " + std::to_string(a.cols()); }

}  // namespace

void require_matrix(const Matrix& a) {
  if (a.rows() < 1 || a.cols() < 1) fail("expected a matrix of at least 1 x 1, got " + shape(a));
}

void require_terms(int terms) {
  if (terms < 1 || terms > kMaxFactors) fail("terms: expected 1 to " + std::to_string(kMaxFactors));
}

void require_weights(const Matrix& weights, const Matrix& a) {
  if (weights.rows() != a.rows() || weights.cols() != a.cols())
    fail("weights: expected " + shape(a) + " as the matrix, got " + shape(weights));
  if (!weights.allFinite() || weights.minCoeff() < 0) fail("weights: expected finite numbers >= 0");
}

void require_number(double value, const char* name) {
  if (!std::isfinite(value) || value < 0) fail(std::string(name) + ": expected a finite number >= 0");
}

Eigen::MatrixXd samples(const Matrix& a, const Matrix& weights) {
  Eigen::MatrixXd s(a.rows(), a.cols());
  for (Eigen::Index j = 0; j < a.cols(); ++j)
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const bool exists = weights(i, j) > 0;
      if (exists) require_sample(a(i, j));
      s(i, j) = exists ? double(a(i, j)) : 0.0;
    }
  return s;
}

void require_sample(float value) {
  if (!(std::abs(value) <= kLargestSample)) fail("expected a matrix of finite numbers, at most 1e30 in size");
}

double uniform(std::uint64_t& state) {
  std::uint64_t z = state += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

void orthonormalize(Eigen::MatrixXd& columns, Eigen::Index first) {
  for (Eigen::Index k = first; k < columns.cols(); ++k) {
    auto column = columns.col(k);
    const double before = column.norm();
    for (int pass = 0; pass < 2; ++pass)
      for (Eigen::Index l = 0; l < k; ++l) column -= columns.col(l).dot(column) * columns.col(l);
    const double after = column.norm();
    if (after > 1e-13 * before)
      column /= after;
    else
      column.setZero();
  }
}

Factors signed_factors(Eigen::MatrixXd surface, Eigen::MatrixXd view) {
  for (Eigen::Index k = 0; k < view.cols(); ++k) {
    if (view.col(k).isZero(0)) surface.col(k).setZero();
    Eigen::Index largest;
    view.col(k).cwiseAbs().maxCoeff(&largest);
    if (view(largest, k) < 0) view.col(k) *= -1, surface.col(k) *= -1;
  }
  return {surface.cast<float>(), view.transpose().cast<float>()};
}

}  // namespace lumihull::slf::factor
