// The pixels near an ellipse.
#pragma once

#include <lumihull/calib/ellipse.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "lanes.h"

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

/// Up to eight pixels of a row, from x on, and which of them are in the band.
struct BandPixels {
  int x = 0, y = 0;
  IntLanes inside;  ///< of the band: -1, else 0
  Lanes distance;   ///< signed, from the contour, px, positive outside: right to second order near it
  Lanes gx, gy;     ///< the contour's outward normal, not of length 1
};

/// Calls body(BandPixels) for the pixels of `box` in the band, row by row, where there are any. Takes time in
/// proportion to the contour's length.
template <class Body>
void for_each_in_band(const Ellipse& e, const UnitFrame& frame, const BandWidth& band, const PixelBox& box,
                      Body&& body) {
  const auto lanes_of = [](double v) { return all(float(v)); };
  const Lanes v11 = lanes_of(frame.inverse(0, 0)), v12 = lanes_of(frame.inverse(0, 1)),
              v22 = lanes_of(frame.inverse(1, 1)), inward = lanes_of(-band.inward), outward = lanes_of(band.outward),
              highest2 = lanes_of(std::min(1e12, band.highest_ratio * band.highest_ratio));
  const Lanes ramp{0, 1, 2, 3, 4, 5, 6, 7};
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
    const Lanes row = lanes_of(dy);
    for (const auto& [first, last] : {std::pair{begin, hole_begin}, {hole_end, end}})
      for (int x = first; x < last; x += kLanes) {
        const Lanes dx = lanes_of(x + 0.5 - e.center.x()) + ramp;
        const Lanes vx = v11 * dx + v12 * row, vy = v12 * dx + v22 * row;
        BandPixels pixels;
        pixels.x = x, pixels.y = y;
        pixels.gx = v11 * vx + v12 * vy, pixels.gy = v12 * vx + v22 * vy;
        const Lanes rho2 = vx * vx + vy * vy + all(1e-12f), steep2 = pixels.gx * pixels.gx + pixels.gy * pixels.gy;
        // (rho - 1) / |d rho / d p|; in the very centre that has no direction, and is some axis.
        const Lanes rho = rho2 * inverse_root(rho2);
        pixels.distance =
            chosen(rho2 < all(1e-8f), lanes_of(-e.b), (rho - all(1)) * rho * inverse_root(steep2 + all(1e-30f)));
        pixels.inside = (pixels.distance >= inward) & (pixels.distance <= outward) & (rho2 <= highest2);
        bool any = false;
        for (int i = 0; i < kLanes; ++i) {
          if (x + i >= last) pixels.inside[i] = 0;
          any |= pixels.inside[i] != 0;
        }
        if (any) body(pixels);
      }
  }
}

}  // namespace lumihull::calib
