#include <lumihull/base/camera.h>
#include <lumihull/base/error.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace lumihull {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A disc of distorted coordinates on which `correct` is surely one-to-one: there the Jacobian of F has norm < 1, so
/// that d -> d + F(d) keeps distances positive. Sufficient, cheap, and true for every ordinary lens over its picture.
bool surely_one_to_one(const Camera& c, double r2) {
  const double r = std::sqrt(r2);
  return 3 * std::abs(c.k1) * r2 + 5 * std::abs(c.k2) * r2 * r2 + 7 * std::abs(c.k3) * r2 * r2 * r2 +
             6 * (std::abs(c.p1) + std::abs(c.p2)) * r <
         0.9;
}

double determinant_at(const Camera& c, const Vector2d& d) {
  Matrix2d j;
  c.correct(d, &j);
  return j.determinant();
}

/// The first radius along a direction at which the Jacobian's determinant stops being positive; `limit` where none.
double first_fold(const Camera& c, double angle, double limit) {
  const Vector2d direction(std::cos(angle), std::sin(angle));
  constexpr int kSteps = 400;
  double low = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double high = limit * i / kSteps;
    if (determinant_at(c, high * direction) > 0) {
      low = high;
      continue;
    }
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (determinant_at(c, middle * direction) > 0 ? low : high) = middle;
    }
    return low;
  }
  return limit;
}

/// Newton's method on correct(d) = target from a start, steps halved until the residual falls; true if <= tolerance.
bool newton(const Camera& c, const Vector2d& target, int steps, double tolerance, Vector2d& d) {
  Matrix2d j;
  Vector2d residual = c.correct(d, &j) - target;
  double error = residual.norm();
  for (int i = 0; i < steps && error > tolerance; ++i) {
    const double determinant = j.determinant();
    if (!(std::abs(determinant) > 1e-300) || !std::isfinite(error)) return false;
    const Vector2d step = j.inverse() * residual;
    double scale = 1;
    for (int k = 0;; ++k) {
      Matrix2d next_j;
      const Vector2d next = d - scale * step;
      const Vector2d next_residual = c.correct(next, &next_j) - target;
      if (next_residual.norm() < error) {
        d = next, residual = next_residual, error = next_residual.norm(), j = next_j;
        break;
      }
      if (k == 8) return error <= tolerance;
      scale *= 0.5;
    }
  }
  return error <= tolerance;
}

}  // namespace

Eigen::Matrix3d Camera::matrix() const {
  Eigen::Matrix3d k;
  k << s * f, skew, u0, 0, f, v0, 0, 0, 1;
  return k;
}

void Camera::validate() const {
  const auto check = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::bad_input, std::string("camera: ") + what);
  };
  check(width > 0 && height > 0 && width <= 65500 && height <= 65500, "width and height must be 1 … 65500 px");
  check(std::isfinite(f) && f > 0, "focal length f must be positive");
  check(std::isfinite(s) && s > 0, "aspect s must be positive");
  check(std::isfinite(skew), "skew must be finite");
  check(std::isfinite(u0) && std::isfinite(v0), "principal point (u0, v0) must be finite");
  for (const double x : {k1, k2, k3, p1, p2}) check(std::isfinite(x), "distortion k1 … p2 must be finite");
}

Vector2d Camera::correct(const Vector2d& d, Matrix2d* jacobian) const {
  const double x = d.x(), y = d.y();
  const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
  const double radial = r2 * (k1 + r2 * (k2 + r2 * k3));
  if (jacobian) {
    const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // d radial / d(r²), times 2
    const double off = xy * slope + 2 * p1 * x + 2 * p2 * y;
    *jacobian << 1 + radial + xx * slope + 2 * p1 * y + 6 * p2 * x, off,  //
        off, 1 + radial + yy * slope + 6 * p1 * y + 2 * p2 * x;
  }
  return {x + x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx), y + y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy};
}

double Camera::domain_radius() const {
  if (!has_distortion()) return std::numeric_limits<double>::infinity();
  // Asked point by point for one lens: the last answer is kept.
  using Lens = std::array<double, 5>;
  thread_local Lens last{};
  thread_local double last_radius = 0;
  const Lens lens{k1, k2, k3, p1, p2};
  if (lens == last) return last_radius;
  // Beyond this radius the highest term rules and its sign decides; a fold, if there is one, lies before it.
  constexpr double kFar = 20;  // 87 degrees off the axis
  constexpr int kAngles = 128;
  double radius = kFar;
  const bool radial_only = p1 == 0 && p2 == 0;
  for (int i = 0; i < (radial_only ? 1 : kAngles); ++i)
    radius = std::min(radius, first_fold(*this, 2 * std::numbers::pi * i / kAngles, radius));
  last = lens;
  last_radius = radius < kFar ? radius : std::numeric_limits<double>::infinity();
  return last_radius;
}

std::optional<Vector2d> Camera::distort(const Vector2d& corrected, Matrix2d* jacobian) const {
  if (!has_distortion()) {
    if (jacobian) jacobian->setIdentity();
    return corrected;
  }
  if (!corrected.allFinite()) return std::nullopt;
  const double tolerance = 1e-13 * std::max(1.0, corrected.norm());

  // Heikkilä's closed form: d = c - F(c) / Q.
  const double r2 = corrected.squaredNorm();
  const double q = 1 + r2 * (4 * k1 + r2 * (6 * k2 + r2 * 8 * k3)) + 8 * p1 * corrected.y() + 8 * p2 * corrected.x();
  Vector2d d = corrected;
  if (q > 0.1) d -= (correct(corrected) - corrected) / q;
  if (!newton(*this, corrected, 10, tolerance, d) || !surely_one_to_one(*this, d.squaredNorm())) {
    // Near the fold: follow the solution from the axis outwards, so that it stays on the branch of the origin.
    const double radius = domain_radius();
    d.setZero();
    constexpr int kSteps = 32;
    for (int i = 1; i <= kSteps; ++i)
      if (!newton(*this, corrected * (double(i) / kSteps), 40, tolerance, d)) return std::nullopt;
    if (!(d.norm() < radius)) return std::nullopt;
  }
  if (jacobian) {
    Matrix2d forward;
    correct(d, &forward);
    *jacobian = forward.inverse();
  }
  return d;
}

std::optional<Vector2d> Camera::project(const Vector3d& point, Matrix23d* jacobian) const {
  if (!(point.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / point.z();
  const Vector2d c(point.x() * inverse_z, point.y() * inverse_z);
  Matrix2d lens;
  const auto d = distort(c, jacobian ? &lens : nullptr);
  if (!d) return std::nullopt;
  if (jacobian) {
    Matrix2d pixel;
    pixel << s * f, skew, 0, f;
    Matrix23d normalise;
    normalise << inverse_z, 0, -c.x() * inverse_z, 0, inverse_z, -c.y() * inverse_z;
    *jacobian = pixel * lens * normalise;
  }
  return pixel_from_distorted(*d);
}

bool Camera::project_with_parameter_jacobian(const Vector3d& point, Vector2d* pixel, Matrix23d* by_point,
                                             Eigen::Matrix<double, 2, 10>* by_parameters) const {
  if (!(point.z() > 0)) return false;
  const double inverse_z = 1 / point.z();
  const Vector2d c(point.x() * inverse_z, point.y() * inverse_z);
  Matrix2d lens;
  const auto d = distort(c, &lens);
  if (!d) return false;
  if (pixel) *pixel = pixel_from_distorted(*d);
  if (by_point) {
    Matrix2d to_pixel;
    to_pixel << s * f, skew, 0, f;
    Matrix23d normalise;
    normalise << inverse_z, 0, -c.x() * inverse_z, 0, inverse_z, -c.y() * inverse_z;
    *by_point = to_pixel * lens * normalise;
  }
  if (by_parameters) {
    const double x = d->x(), y = d->y(), r2 = d->squaredNorm();
    // d + F(d, k) = c with c fixed: (I + dF/dd) dd + dF/dk = 0, so dd/dk = -lens * dF/dk.
    Eigen::Matrix<double, 2, 5> by_coefficient;
    by_coefficient << x * r2, x * r2 * r2, x * r2 * r2 * r2, 2 * x * y, r2 + 2 * x * x,  //
        y * r2, y * r2 * r2, y * r2 * r2 * r2, r2 + 2 * y * y, 2 * x * y;
    Matrix2d k;
    k << s * f, skew, 0, f;
    *by_parameters << s * x, f * x, y, 1, 0, Eigen::Matrix<double, 1, 5>::Zero(),  //
        y, 0, 0, 0, 1, Eigen::Matrix<double, 1, 5>::Zero();
    by_parameters->rightCols<5>() = -k * lens * by_coefficient;
  }
  return true;
}

std::optional<Vector3d> Camera::ray(const Vector2d& pixel) const {
  const Vector2d d = distorted_from_pixel(pixel);
  if (!d.allFinite()) return std::nullopt;
  if (!has_distortion()) return Vector3d(d.x(), d.y(), 1);
  if (!surely_one_to_one(*this, d.squaredNorm()) && !(d.norm() < domain_radius())) return std::nullopt;
  const Vector2d c = correct(d);
  return Vector3d(c.x(), c.y(), 1);
}

}  // namespace lumihull
