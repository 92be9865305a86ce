// The pixels near an ellipse.
#pragma once

#include <lumihull/calib/ellipse.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace lumihull::calib {

/// How far pixels may be from a contour, px along its normal, and how far out in multiples of the ellipse.
struct BandWidth {
  double inward = 0, outward = 0;
  double highest_ratio = 1e9;  ///< of a pixel's distance from the centre to the contour's in the same direction
};

/// Coordinates in which an ellipse is the unit circle: v = inverse · (p - center).
struct UnitFrame {
  Eigen::Vector2d center;
  Eigen::Matrix2d root;     ///< symmetric, root · root = shape
  Eigen::Matrix2d inverse;  ///< of root

  explicit UnitFrame(const Ellipse& e) : center(e.center) {
    const double c = std::cos(e.angle), s = std::sin(e.angle);
    const auto symmetric = [&](double p, double q) {
      Eigen::Matrix2d m;
      m << p * c * c + q * s * s, (p - q) * c * s, (p - q) * c * s, p * s * s + q * c * c;
      return m;
    };
    root = symmetric(e.a, e.b);
    inverse = symmetric(1 / e.a, 1 / e.b);
  }

  /// Signed distance from the contour, px, positive outside: right to second order near it.
  double distance(const Eigen::Vector2d& v) const {
    const double rho = v.norm();
    return rho > 0 ? (rho - 1) * rho / (inverse * v).norm() : -1 / inverse.norm();
  }
};

/// A picture's pixels from (x0, y0) to before (x1, y1).
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Half of the width and height of an ellipse's bounding box.
inline Eigen::Vector2d half_extent(const Ellipse& e) {
  const double c = std::cos(e.angle), s = std::sin(e.angle);
  return {std::hypot(e.a * c, e.b * s), std::hypot(e.a * s, e.b * c)};
}

/// Whether the contour with a margin is in the box.
inline bool contains(const PixelBox& box, const Ellipse& e, double margin) {
  const Eigen::Vector2d half = half_extent(e);
  return e.center.x() - half.x() - margin >= box.x0 && e.center.x() + half.x() + margin <= box.x1 &&
         e.center.y() - half.y() - margin >= box.y0 && e.center.y() + half.y() + margin <= box.y1;
}

/// Calls body(x, y, v, distance) for the pixels of `box` in the band, row by row; v: in the unit frame. Takes time in
/// proportion to the contour's length.
template <class Body>
void for_each_in_band(const Ellipse& e, const UnitFrame& frame, const BandWidth& band, const PixelBox& box,
                      Body&& body) {
  // An ellipse that surely holds the band, and one that surely holds none of it.
  Ellipse outer = e;
  outer.a += 1.3 * band.outward + 1;
  outer.b += 1.3 * band.outward + 1;
  const Eigen::Matrix2d outer_q = outer.shape();
  const double core = std::max(0.0, 1 - band.inward / e.b), q22 = outer_q(1, 1);
  const Eigen::Matrix2d core_q = core * core * e.shape();
  /// The chord of an ellipse in the row dy above its centre.
  const auto chord = [](const Eigen::Matrix2d& q, double dy, double& middle, double& half) {
    const double rest = 1 - dy * dy / q(1, 1);
    if (!(rest > 0)) return false;
    middle = q(0, 1) / q(1, 1) * dy;
    half = std::sqrt(std::max(0.0, (q(0, 0) - q(0, 1) * q(0, 1) / q(1, 1)) * rest));
    return true;
  };
  const double reach = std::sqrt(q22);
  const int y_first = int(std::max<double>(box.y0, std::floor(e.center.y() - reach)));
  const int y_last = int(std::min<double>(box.y1, std::ceil(e.center.y() + reach)));
  for (int y = y_first; y < y_last; ++y) {
    const double dy = y + 0.5 - e.center.y();
    double middle = 0, half = 0;
    if (!chord(outer_q, dy, middle, half)) continue;
    const auto clamped = [&](double x) { return int(std::clamp<double>(x, box.x0, box.x1)); };
    const int begin = clamped(std::floor(e.center.x() + middle - half)),
              end = clamped(e.center.x() + middle + half + 1);
    int hole_begin = end, hole_end = end;
    if (core > 0 && chord(core_q, dy, middle, half)) {
      hole_begin = std::max(begin, clamped(std::ceil(e.center.x() + middle - half)));
      hole_end = std::max(hole_begin, clamped(std::floor(e.center.x() + middle + half)));
    }
    for (int x = begin; x < end; ++x) {
      if (x == hole_begin) x = hole_end;
      if (x >= end) break;
      const Eigen::Vector2d v = frame.inverse * Eigen::Vector2d(x + 0.5 - e.center.x(), dy);
      const double d = frame.distance(v);
      if (d >= -band.inward && d <= band.outward && v.squaredNorm() <= band.highest_ratio * band.highest_ratio)
        body(x, y, v, d);
    }
  }
}

}  // namespace lumihull::calib
