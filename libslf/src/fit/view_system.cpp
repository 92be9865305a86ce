#include "view_system.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace lumihull::slf {
namespace {

constexpr int kIterations = 12;
constexpr float kNothing = 1e-20f;    // what counts less would leave the range of floats when it is divided by
constexpr double kGoodEnough = 1e-6;  // squared residual, relative

/// y += S x for a symmetric matrix given by its lower triangle.
inline void add_product(const float* packed, std::size_t n, const float* x, float* y) {
  for (std::size_t k = 0; k < n; ++k) {
    float sum = 0;
    const float xk = x[k];
    for (std::size_t l = 0; l < k; ++l, ++packed) sum += *packed * x[l], y[l] += *packed * xk;
    y[k] += sum + *packed++ * xk;
  }
}

double dot(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double(a[i]) * b[i];
  return sum;
}

}  // namespace

ViewSystem::Edges::Edges(const hull::Mesh& mesh) {
  std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> sides;  // vertices and 3 triangle + side
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
      sides.emplace_back(std::min(a, b), std::max(a, b), 3 * t + i);
    }
  std::sort(sides.begin(), sides.end());
  of_triangle.resize(mesh.triangles.size());
  for (const auto& [a, b, at] : sides) {
    if (vertices.empty() || vertices.back() != std::array{a, b}) vertices.push_back({a, b});
    of_triangle[at / 3][at % 3] = std::uint32_t(vertices.size() - 1);
  }
}

ViewSystem::ViewSystem(std::size_t terms, std::size_t vertices, std::span<const std::array<std::uint32_t, 2>> edges)
    : terms_(terms),
      packed_(terms * (terms + 1) / 2),
      edges_(edges),
      diagonal_(vertices * packed_),
      off_(edges.size() * packed_),
      right_(vertices * terms) {}

void ViewSystem::add(const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges,
                     const std::array<float, 3>& share, std::span<const float> gram, std::span<const float> right) {
  const auto add_to = [&](std::vector<float>& blocks, std::size_t at, float s) {
    float* to = &blocks[at * packed_];
    for (std::size_t i = 0; i < packed_; ++i) to[i] += s * gram[i];
  };
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    add_to(diagonal_, corners[i], share[i] * share[i]);
    add_to(off_, edges[i], share[i] * share[j]);
    float* to = &right_[corners[i] * terms_];
    for (std::size_t k = 0; k < terms_; ++k) to[k] += share[i] * right[k];
  }
}

std::vector<float> ViewSystem::trust() const {
  std::vector<float> out(right_.size() / terms_, 0);
  for (std::size_t v = 0; v < out.size(); ++v) {
    std::size_t at = v * packed_;
    for (std::size_t k = 0; k < terms_; ++k, at += k + 1) out[v] += diagonal_[at] / float(terms_);
    if (out[v] < kNothing) out[v] = 0;
  }
  return out;
}

void ViewSystem::multiply(std::span<const float> x, float ridge, std::span<float> y) const {
  for (std::size_t i = 0; i < x.size(); ++i) y[i] = ridge * x[i];
  for (std::size_t v = 0; v < x.size() / terms_; ++v)
    add_product(&diagonal_[v * packed_], terms_, &x[v * terms_], &y[v * terms_]);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto [a, b] = edges_[e];
    add_product(&off_[e * packed_], terms_, &x[b * terms_], &y[a * terms_]);
    add_product(&off_[e * packed_], terms_, &x[a * terms_], &y[b * terms_]);
  }
}

void ViewSystem::solve(std::span<float> values, float ridge_share) const {
  const std::size_t vertices = values.size() / terms_, n = values.size();
  const auto k = std::ptrdiff_t(terms_);
  const std::vector<float> behind = trust();
  double sum = 0;
  std::size_t seen = 0;
  for (const float t : behind)
    if (t > 0) sum += t, ++seen;
  if (seen == 0) return;
  const float ridge = ridge_share * float(sum / double(seen));

  std::vector<float> inverse(vertices * terms_ * terms_);
  for (std::size_t v = 0; v < vertices; ++v) {
    Eigen::MatrixXf block(k, k);
    const float* at = &diagonal_[v * packed_];
    for (std::ptrdiff_t i = 0; i < k; ++i)
      for (std::ptrdiff_t j = 0; j <= i; ++j) block(i, j) = block(j, i) = *at++;
    block.diagonal().array() += ridge;
    Eigen::Map<Eigen::MatrixXf>(&inverse[v * terms_ * terms_], k, k) =
        block.llt().solve(Eigen::MatrixXf::Identity(k, k));
  }
  const auto precondition = [&](std::span<const float> r, std::span<float> z) {
    for (std::size_t v = 0; v < vertices; ++v)
      Eigen::Map<Eigen::VectorXf>(&z[v * terms_], k).noalias() =
          Eigen::Map<const Eigen::MatrixXf>(&inverse[v * terms_ * terms_], k, k) *
          Eigen::Map<const Eigen::VectorXf>(&r[v * terms_], k);
  };

  // The start is the values that are pulled to: then (A + ridge) x = b + ridge x0 has the residual b - A x0.
  std::vector<float> r(n), z(n), p(n), q(n);
  multiply(values, 0, q);
  for (std::size_t i = 0; i < n; ++i) r[i] = right_[i] - q[i];
  precondition(r, z);
  p = z;
  double rz = dot(r, z);
  const double enough = kGoodEnough * rz;
  for (int it = 0; it < kIterations && rz > enough && rz > 0; ++it) {
    multiply(p, ridge, q);
    const double curvature = dot(p, q);
    if (!(curvature > 0)) break;
    const auto step = float(rz / curvature);
    for (std::size_t i = 0; i < n; ++i) values[i] += step * p[i], r[i] -= step * q[i];
    precondition(r, z);
    const double next = dot(r, z);
    const auto keep = float(next / rz);
    rz = next;
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + keep * p[i];
  }
}

}  // namespace lumihull::slf
