#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "side_fit.h"
#include "square_check.h"

namespace lumihull::calib {

using Quad = std::array<Eigen::Vector2d, 4>;

/// The homography that takes (0, 0), (side, 0), (side, side), (0, side) to four corners. nullopt where three of them are
/// in a line, or they are not clockwise and convex.
std::optional<Eigen::Matrix3d> homography_of_square(const Quad& corners, double side);

/// A square measured in a picture.
struct SquareMeasurement {
  Quad corners;  ///< clockwise in the picture, in the order of the rough ones
  std::array<Eigen::Matrix2d, 4> covariance;
  std::array<SideFit, 4> sides;  ///< side k runs from corner k to corner k + 1
  SquareLevels levels;
  double blur_px = 1;  ///< mean of the sides'
};

/// Measures a square whose corners are known to `reach_px`. grid: cells along a side, the border's included; `cells` as
/// seen in the picture (corner 0 = top left), or empty where they are not known yet.
std::optional<SquareMeasurement> measure_square(const LightPlane& plane, const Quad& rough, double reach_px, int grid,
                                                double curvature_sd);

/// The same again from a first measurement, with what is known of the cells and of the light; repeated until the corners
/// rest, for what leaks into a blurred border depends on the answer. What they still move by in the end is added to their
/// covariance.
std::optional<SquareMeasurement> measure_square_again(const LightPlane& plane, const SquareMeasurement& first, int grid,
                                                      const std::vector<Cell>& cells, double curvature_sd);

}  // namespace lumihull::calib
