#pragma once

// Where a field of points is in a picture, to about a pixel: by OpenCV.

#include <lumihull/base/image.h>
#include <lumihull/calib/target_set.h>

#include <Eigen/Core>
#include <vector>

namespace lumihull::calib::lens {

/// columns x rows points, row-major in one of the orders that the grid's symmetries and mirroring allow; empty where
/// none was found. photo: 8 bits, 1 channel.
std::vector<Eigen::Vector2d> grid_start(const Image& photo, const PointGrid& grid);

}  // namespace lumihull::calib::lens
