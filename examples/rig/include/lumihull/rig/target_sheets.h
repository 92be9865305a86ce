#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/calib/target_set.h>
#include <lumihull/rig/scene.h>

#include <cstdint>
#include <memory>
#include <span>
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
  double density = .3;    ///< share of walls and floor that sheets cover, at most .4; fewer where they find no place
  std::uint64_t seed = 1;
};

/// Scatters sheets with a target of matrix6x6 each at random over walls and floor: small ones around the object, large
/// ones on walls, so that cameras on a hemisphere of radius `distance` (m) around the scene's centre see enough of them
/// all around (paper, 3.1: at least five in each picture). Dark green on light green, in the enclosure's own hue.
/// Errors: invalid_argument (options; more sheets than the family has ids).
RoomTargets scatter_targets(const Scene& scene, const Camera& camera, double distance,
                            const TargetSheetOptions& options);

/// What counts as a target that can be decoded in a photograph: all of its circles are in the picture, none smaller
/// than this, nothing in front of it.
struct TargetReach {
  double border = .02;           ///< of the picture's width, on each side, that counts as outside
  double least_circle_px = 5.5;  ///< minor axis; the detector looks for 4.5 px
};

/// Which of a room's targets a view can decode.
class TargetSights {
 public:
  explicit TargetSights(const Scene& scene, const TargetReach& reach = {});
  TargetSights(TargetSights&&) noexcept;
  ~TargetSights();

  bool decodable(const View& view, const calib::TargetDesign& design, const Pose& world_from_target) const;
  /// Indices into targets.placed.
  std::vector<std::size_t> decodable(const View& view, const RoomTargets& targets) const;
  /// Whether the object or the pedestal stands between two points.
  bool hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  const Scene& scene() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// Hangs more sheets where views see fewer than `least` targets that can be decoded; returns the indices of views that
/// still do: no free place could be found. Deterministic.
std::vector<std::size_t> add_sheets(RoomTargets& targets, std::span<const View> views, int least,
                                    const TargetSights& sights, std::uint64_t seed);

}  // namespace lumihull::rig
