// What share of a blurred pixel lies within a contour that is mildly curved, by distance and curvature.
#pragma once

#include <Eigen/Core>

#include "blurred_ellipse.h"
#include "lanes.h"

namespace lumihull::calib {

/// BlurredEllipse's sum expanded about the contour's nearest point, in the curvature κ and the blur s: with the
/// distance d = δ s outward, k = κ s and q = s³ d²κ/dσ² along the contour (its even terms; the odd ones vanish in first
/// order)
///
///     w = Φ(-δ) - φ(δ) B,   B = k/2 - 3/8 k² δ + k³ (3/8 + 5/16 (δ² - 1)) + q/8,
///
/// from E[Φ(-δ + h(y))] over y ~ N(0, 1) with the contour at h = -k y²/2 - k³ y⁴/8 - q y⁴/24. Derivatives are those of
/// this w by d, κ and s, so they are right to about k². A tenth of the sum's time, whatever the contour's length.
class CurvedEdge {
 public:
  /// The points of the unit circle whose images are nearest to eight pixels.
  struct Foot {
    Lanes x, y;
  };

  /// The contour is center + ratio · root · u, u on the unit circle; inner: it ends what the share counts, as a ring's
  /// inner contour does.
  void set(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double s, double ratio, bool inner);

  /// From nowhere: to about 1e-3 where the pixels are nearer than the centres of curvature.
  void find(const BlurredEllipse::Pixels& pixels, Foot& foot) const;
  /// Makes the feet of a contour that lay nearly the same this one's (a step of Newton's).
  void follow(const BlurredEllipse::Pixels& pixels, Foot& foot) const;
  /// Adds this contour's part to `share`. Feet that are off by an angle t make the distance wrong by t² of a radius.
  void add(const BlurredEllipse::Pixels& pixels, const Foot& foot, BlurredEllipse::Share& share) const;

 private:
  struct Place {
    Lanes qx, qy, tx, ty, t2;  ///< root · u, its derivative along the circle, and the square of that one's length
  };
  Place place(const Foot& foot) const;
  void approach(const Lanes& x, const Lanes& y, Foot& foot) const;

  float cx_ = 0, cy_ = 0, m11_ = 1, m12_ = 0, m22_ = 1;  // root of this contour, ratio included
  float i11_ = 1, i12_ = 0, i22_ = 1, det_ = 1;          // its inverse
  float s_ = 1, ratio_ = 1, sign_ = 1;
  bool inner_ = false;
};

}  // namespace lumihull::calib
