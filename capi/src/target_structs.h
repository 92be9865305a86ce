#pragma once

// The structures of lumihull_calib.h that describe targets, in and out.

#include <lumihull.h>
#include <lumihull/calib/target_set.h>

namespace lumihull::capi {

/// Checks what C can't say; the rest is for those who use it. user: NULL is the defaults, as large as fits.
calib::TargetDesign design_from(const char* family, const lh_target_design* user, const char* name);
lh_target_design design_to(const calib::TargetDesign& design);

calib::PointGrid grid_from(const lh_point_grid* user, const char* name);
lh_point_grid grid_to(const calib::PointGrid& grid);

}  // namespace lumihull::capi
