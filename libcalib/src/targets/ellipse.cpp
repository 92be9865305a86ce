// Ellipses: axes, shape matrix and dual conic.
#include <lumihull/base/error.h>
#include <lumihull/calib/ellipse.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace lumihull::calib {

Eigen::Matrix2d Ellipse::shape() const {
  const double c = std::cos(angle), s = std::sin(angle), aa = a * a, bb = b * b;
  Eigen::Matrix2d q;
  q << aa * c * c + bb * s * s, (aa - bb) * c * s, (aa - bb) * c * s, aa * s * s + bb * c * c;
  return q;
}

std::optional<Ellipse> Ellipse::from_shape(const Eigen::Vector2d& center, const Eigen::Matrix2d& shape) {
  const double q11 = shape(0, 0), q12 = 0.5 * (shape(0, 1) + shape(1, 0)), q22 = shape(1, 1);
  const double mean = 0.5 * (q11 + q22), half = 0.5 * (q11 - q22), swing = std::hypot(half, q12);
  if (!center.allFinite() || !(mean - swing > 0) || !std::isfinite(mean)) return std::nullopt;
  double angle = swing > 0 ? 0.5 * std::atan2(q12, half) : 0;  // (-pi/2, pi/2]
  if (angle <= -0.5 * std::numbers::pi) angle = 0.5 * std::numbers::pi;
  return Ellipse{center, std::sqrt(mean + swing), std::sqrt(mean - swing), angle};
}

Eigen::Matrix3d Ellipse::dual_conic() const {
  Eigen::Matrix3d dual;
  dual.topLeftCorner<2, 2>() = center * center.transpose() - shape();
  dual.topRightCorner<2, 1>() = center;
  dual.bottomLeftCorner<1, 2>() = center.transpose();
  dual(2, 2) = 1;
  return dual;
}

std::optional<Ellipse> Ellipse::from_dual_conic(const Eigen::Matrix3d& dual) {
  const double f = dual(2, 2);
  if (!dual.allFinite() || std::abs(f) <= 1e-300) return std::nullopt;
  const Eigen::Vector2d center = Eigen::Vector2d(dual(0, 2) + dual(2, 0), dual(1, 2) + dual(2, 1)) / (2 * f);
  return from_shape(center, center * center.transpose() - dual.topLeftCorner<2, 2>() / f);
}

Eigen::Vector2d Ellipse::point(double t) const {
  return center + Eigen::Rotation2Dd(angle) * Eigen::Vector2d(a * std::cos(t), b * std::sin(t));
}

void EllipseOptions::validate() const {
  const auto need = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::invalid_argument, what, "ellipse options");
  };
  need(gradient_sigma_px >= 0.5 && gradient_sigma_px <= 5, "gradient_sigma_px must be 0.5 to 5");
  need(min_visible >= 0 && min_visible <= 1, "min_visible must be 0 to 1");
  need(max_saturated >= 0 && max_saturated <= 1, "max_saturated must be 0 to 1");
  need(min_contrast_noise >= 0 && std::isfinite(min_contrast_noise), "min_contrast_noise must be 0 or more");
  need(inner_ratio >= 0 && inner_ratio <= 0.9, "inner_ratio must be 0 to 0.9");
  need(inner_offset.allFinite(), "inner_offset must be finite");
}

}  // namespace lumihull::calib
