#pragma once

// Covariances in JSON: the upper triangle row by row, N (N + 1) / 2 numbers. What is read is a covariance.

#include <lumihull/internal/json.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Core>

namespace lumihull::internal {

template <int N>
Eigen::Matrix<double, N, N> read_covariance(const JsonReader& json) {
  using Matrix = Eigen::Matrix<double, N, N>;
  constexpr std::size_t kCount = std::size_t(N * (N + 1) / 2);
  const std::string numbers = std::to_string(kCount) + " numbers, the upper triangle of a covariance";
  if (!json.value().is_array() || json.value().size() != kCount) json.fail(numbers);
  Matrix c;
  std::size_t at = 0;
  for (int i = 0; i < N; ++i)
    for (int k = i; k < N; ++k) c(i, k) = c(k, i) = json.at(at++).number(-1e30, 1e30);
  for (int i = 0; i < N; ++i) {
    if (!(c(i, i) >= 0)) json.fail(numbers + " without negative variances");
    if (!(c(i, i) > 0) && !c.row(i).isZero(0)) json.fail(numbers + " with zeros where the variance is 0");
  }
  if (!is_covariance(c)) json.fail(numbers + " without negative eigenvalues");
  return c;
}

template <int N>
Json print_covariance(const Eigen::Matrix<double, N, N>& c) {
  Json list = Json::array();
  for (int i = 0; i < N; ++i)
    for (int k = i; k < N; ++k) list.push_back(c(i, k));
  return list;
}

}  // namespace lumihull::internal
