// What share of a blurred pixel an ellipse, or a ring, covers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "lanes.h"

namespace lumihull::calib {

/// Share w of each pixel that is covered, once the picture is blurred by a Gaussian, and its derivatives.
///
///     w(p) = ∫_E G(q - p) dq = ∮ F · n ds,   F = u φ(τ / s) / s · Φ(ν / s),   div F = G = N(0, s²)
///
/// by the divergence theorem, with ν and τ the coordinates of q - p along an axis u of the picture and across it: a sum
/// over points of the contour, which converges like exp(-2 π² (s / spacing)²) as the integrand is smooth and periodic.
/// It is exact for any curvature. When the contour moves by dq the share changes by ∮ G dq · n ds (Reynolds), and with
/// s by s ∇² w = -∮ G (q - p) · n ds / s: the same sums.
///
/// Pixels integrate over their square, which has the variance 1/12 and the fourth cumulant -1/120 along each axis: s² =
/// blur² + 1/12, and the cumulant's term -(∂x⁴ + ∂y⁴) w / 2880 is added.
class BlurredEllipse {
 public:
  /// Which way u points from a pixel: towards the contour's nearer side, so that the other side has no part.
  enum Side : int { right, left, bottom, top, kSides };

  /// Eight pixels on one side of the ellipse.
  struct Pixels {
    Lanes x, y;  ///< px, about the contour's origin
    float low_x, high_x, low_y, high_y;
    Side side;
  };
  /// w, and its derivatives by centre (2), root matrix (11, 12, 22), s and the inner ratio.
  struct Share {
    Lanes w, by_center[2], by_root[3], by_s, by_ratio;
  };

  /// The contour is center + root u, u on the unit circle; center: about an origin of the caller's. inner_ratio > 0: a
  /// ring, whose inner contour's centre is inner_offset off.
  void set(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double s, double inner_ratio,
           const Eigen::Vector2d& inner_offset = {0, 0});
  void evaluate(const Pixels& pixels, Share& share) const;
  /// w alone, in a third of the time.
  Lanes covered(const Pixels& pixels) const;

 private:
  static constexpr int kGroup = 4;  // nodes that are kept or skipped together
  struct Node {
    float x, y;     // in units of s
    float nx, ny;   // n ds / s: of the outer contour outward, of the inner one inward
    float root[3];  // n ds · dq / d root
    float ratio;    // n ds · dq / d ratio
  };
  struct Group {
    float low_x, high_x, low_y, high_y;
  };
  template <bool derivatives>
  void sum(const Pixels& pixels, Share& share) const;
  void add_contour(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double ratio, double sign);

  std::vector<Node> nodes_;
  std::vector<Group> groups_;
  double s_ = 1;
  bool ring_ = false;
};

}  // namespace lumihull::calib
