#pragma once

#include <lumihull/base/api.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/lens_calibration.h>
#include <lumihull/calib/target_set.h>

#include <string>
#include <vector>

namespace lumihull::calib {

/// What was found in one photograph, as calibration takes it: a view for each board of the set, with all of its targets
/// that were found, named after the photograph ("PHOTO" or, where the photograph shows several, "PHOTO: BOARD"). Where
/// the set has no boards each target is a body of its own ("PHOTO: FAMILY ID"). Targets that are on no board are left
/// out.
LUMIHULL_API std::vector<BoardView> board_views(const TargetSet& set, const Detections& found,
                                                const std::string& photo);

/// The same of a point grid (find_point_grid): circles with their radius, corners as points.
LUMIHULL_API BoardView grid_view(const PointGrid& grid, const Detection& found, const std::string& photo);

}  // namespace lumihull::calib
