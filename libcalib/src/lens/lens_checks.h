#pragma once

// Whether a calibration can be believed: weak geometry named with what to do, and cross-validation by halves.

#include <string>
#include <vector>

#include "lens_normal.h"

namespace lumihull::calib::lens {

/// Largest angle (rad) between the normals of two views' planes, seen from the camera; views must show planes.
double largest_tilt(const std::vector<FittedView>& views);

/// How many equations for K the views of planes give: two for each orientation that none of the others has, to 1 degree
/// (Zhang 2000, section 2.4: parallel planes add nothing).
int plane_equations(const std::vector<FittedView>& views);

/// Sentences about what is weak. `result`: camera, covariance, residuals, sigma0 and cross-validation are there.
std::vector<std::string> weak_geometry(const LensCalibration& result, std::span<const BoardView> views,
                                       const std::vector<FittedView>& fitted, bool all_planar,
                                       const std::array<bool, kIntrinsics>& free);

/// Fills cross_validation_px and cross_validation_sigma: every other view alone, from the whole answer on.
void cross_validate(LensCalibration& result, const std::vector<FittedView>& fitted,
                    const std::array<bool, kIntrinsics>& free, int max_iterations, const Job& job);

}  // namespace lumihull::calib::lens
