#pragma once

#include <lumihull/rig/target_sheets.h>

#include <optional>

#include "room.h"

namespace lumihull::rig {

/// Side of a sheet, m.
double sheet_width(const calib::TargetDesign& design);

/// Hangs one more sheet; its id is the next that is free. Error{invalid_argument} where there is none.
void hang(RoomTargets& targets, int design, const Pose& world_from_target, const char* where);

/// The pose of a sheet about a place of the floor or a panel, turned a little (askew: -1 … 1; on the floor any way);
/// nullopt where it would reach over the surface's edge, another sheet, or the pedestal.
std::optional<Pose> free_place(const RoomTargets& targets, const Scene& scene, int design, const RoomHit& at,
                               double askew);

/// Error{invalid_argument} where no sheet hangs in the room. circle_px: the wanted diameter of circles.
void expect_hung(const RoomTargets& targets, double circle_px);

}  // namespace lumihull::rig
