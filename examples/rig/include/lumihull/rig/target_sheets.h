#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/calib/target_set.h>
#include <lumihull/rig/scene.h>

#include <cstdint>
#include <vector>

namespace lumihull::rig {

/// A printed sheet that was put up in the room.
struct PlacedTarget {
  int design = 0;  ///< index into RoomTargets::set.designs
  int id = 0;
  Pose world_from_target;
};

/// What was printed, where it hangs, and how it looks.
struct RoomTargets {
  calib::TargetSet set;  ///< one board a sheet, for three sizes share a family
  std::vector<PlacedTarget> placed;
  std::vector<FlatPrint> prints;
};

/// How sheets are spread over the enclosure.
struct TargetSheetOptions {
  double circle_px = 12;  ///< diameter of the circles, seen straight from where cameras usually are
  double spacing = 1.6;   ///< from one sheet to the next, in widths of a sheet; at least 1.5 (sheets lie askew)
  std::uint64_t seed = 1;
};

/// Scatters sheets with a target of matrix6x6 each over walls and floor: small ones around the object, large ones on
/// walls, so that cameras on a hemisphere of radius `distance` (m) around the scene's centre see enough of them all
/// around (paper, 3.1: at least five in each picture). Dark green on light green, in the enclosure's own hue.
/// Errors: invalid_argument (options; more sheets than the family has ids).
RoomTargets scatter_targets(const Scene& scene, const Camera& camera, double distance,
                            const TargetSheetOptions& options);

}  // namespace lumihull::rig
