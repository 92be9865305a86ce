#pragma once

#include <Eigen/Core>
#include <vector>

namespace lumihull::slf {

/// A picture of one channel, row by row.
struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;

  float at(int x, int y) const { return values[std::size_t(y) * std::size_t(width) + std::size_t(x)]; }
};

/// Three passes of a running mean over 2 r + 1 values along rows, then columns: nearly a Gaussian of sigma r + 0.5.
void smooth(Plane& plane, int r);

/// A local maximum.
struct BrightSpot {
  Eigen::Vector2d
      pixel;  ///< centroid of what is above half of the height, within its own basin; (0.5, 0.5) = first pixel's centre
  Eigen::Vector2d peak;  ///< centre of its highest pixel
  float height = 0;
};

/// Local maxima of at least `least` whose height above the highest pass to a higher one is at least `prominence` of
/// their own height; others belong to the spot that they lead to. The highest first (ties: in reading order).
std::vector<BrightSpot> bright_spots(const Plane& plane, float least, float prominence);

}  // namespace lumihull::slf
