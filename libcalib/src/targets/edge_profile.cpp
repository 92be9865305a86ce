#include "edge_profile.h"

#include <algorithm>
#include <cmath>

namespace lumihull::calib {
namespace {

constexpr double kInvSqrt2 = 0.70710678118654752440, kInvSqrt2Pi = 0.39894228040143267794;

/// Below this width of the narrower box its shape is left to a Gaussian of the same variance (width² / 12).
constexpr double kNarrowBox = 0.02;

struct Integrals {
  double density, a0, a1, a2;
};

Integrals integrals(double x, double sigma) {
  const double z = x / sigma;
  const double cdf = 0.5 * std::erfc(-z * kInvSqrt2), pdf = kInvSqrt2Pi * std::exp(-0.5 * z * z);
  return {pdf / sigma, cdf, x * cdf + sigma * pdf, 0.5 * ((x * x + sigma * sigma) * cdf + x * sigma * pdf)};
}

}  // namespace

EdgeProfile::EdgeProfile(const Eigen::Vector2d& normal, double sigma) : sigma_(sigma) {
  const double wide = std::max(std::abs(normal.x()), std::abs(normal.y()));
  const double narrow = std::min(std::abs(normal.x()), std::abs(normal.y()));
  reach_ = 6 * sigma + 0.75;
  step_ = std::min(0.25, sigma / 4);
  const int half = int(std::ceil(reach_ / step_));
  reach_ = half * step_;
  nodes_.resize(std::size_t(2 * half + 2));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const double x = (double(i) - half) * step_;
    Node& n = nodes_[i];
    if (narrow < kNarrowBox) {
      const double s = std::sqrt(sigma * sigma + narrow * narrow / 12);
      const Integrals a = integrals(x + 0.5 * wide, s), b = integrals(x - 0.5 * wide, s);
      n = {(a.a1 - b.a1) / wide, (a.a0 - b.a0) / wide, (a.density - b.density) / wide};
    } else {
      const double p = 0.5 * (wide + narrow), m = 0.5 * (wide - narrow), area = wide * narrow;
      const Integrals a = integrals(x + p, sigma), b = integrals(x + m, sigma), c = integrals(x - m, sigma),
                      d = integrals(x - p, sigma);
      n = {(a.a2 - b.a2 - c.a2 + d.a2) / area, (a.a1 - b.a1 - c.a1 + d.a1) / area, (a.a0 - b.a0 - c.a0 + d.a0) / area};
    }
  }
}

EdgeProfile::Value EdgeProfile::at(double x) const {
  if (!(x > -reach_)) return {0, 0, 0};
  if (x >= reach_) return {1, 0, 0};
  const double place = (x + reach_) / step_;
  const std::size_t i = std::min(std::size_t(place), nodes_.size() - 2);
  const double t = place - double(i), h = step_;
  const Node &a = nodes_[i], &b = nodes_[i + 1];
  // Hermite's basis.
  const double t2 = t * t, t3 = t2 * t;
  const double h00 = 2 * t3 - 3 * t2 + 1, h10 = t3 - 2 * t2 + t, h01 = 3 * t2 - 2 * t3, h11 = t3 - t2;
  return {h00 * a.f0 + h01 * b.f0 + h * (h10 * a.f1 + h11 * b.f1),
          h00 * a.f1 + h01 * b.f1 + h * (h10 * a.f2 + h11 * b.f2), sigma_ * (a.f2 + t * (b.f2 - a.f2))};
}

}  // namespace lumihull::calib
