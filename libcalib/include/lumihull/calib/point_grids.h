#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/detection.h>

#include <optional>

namespace lumihull::calib {

/// Finds a field of points without ids in a photograph and measures its points, with covariances by propagating the
/// picture's noise.
///
/// Chessboards: inner corners, by fitting two crossing edges (their blur, levels and shading) to the pixels around each
/// one, in linear light. Circles: ellipses' centres (fit_ellipse). All of the field's points must be in the picture;
/// points that can't be measured well are left out of the answer, and nullopt is returned where a third or more are.
///
/// Which point is the first: of the numberings by which rows and columns run as in the grid's frame (z away from the
/// camera), that for which the field between the first four corners of a chessboard is dark; where that leaves a choice
/// (circles; chessboards with columns + rows even), that whose first point is nearest to the picture's top left corner.
/// Photographs taken from above and from below then differ by half a turn of the board, which lens calibration does not
/// mind: each has its own pose.
///
/// photo: any size, type, 1, 3 or 4 channels. The detection's design is 0 and its id -1.
/// Errors: invalid_argument (an empty photograph; fewer than 3 columns or rows, or more than 100; spacing).
LUMIHULL_API std::optional<Detection> find_point_grid(const Image& photo, const PointGrid& grid, Job& job);

}  // namespace lumihull::calib
