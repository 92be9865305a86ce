#pragma once

#include <lumihull/capture/optics.h>
#include <lumihull/capture/plan.h>

#include <cstdint>
#include <filesystem>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// How the camera is turned about the platform's z axis, so that it faces the object from each azimuth.
enum class Bearing : std::uint8_t {
  fixed,    ///< not at all: roll 0 everywhere
  gravity,  ///< a solenoid frees it where the platform is tilted enough (paper, 2.3)
  motor,    ///< anywhere, within the time of settling
};

/// Views of an object from a hemisphere (paper, 2.2).
struct HemisphereOptions {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_m = 1.5;
  int azimuths = 24, rows = 10;  ///< rows from phi_from to phi_to, both included; a single row lies at phi_to
  double spacing_rad = 0;        ///< > 0: in place of `azimuths` and `rows`, steps of at most this angle
  bool thin = false;             ///< fewer azimuths towards the zenith: steps no finer than on the equator
  double phi_from_rad = 0, phi_to_rad = std::numbers::pi / 2;
  double tilt_factor = 2.0 / 3, tilt_offset_rad = -std::numbers::pi / 6;  ///< f and δ: φ_t = f φ + δ (paper, eq. 6)
  Bearing bearing = Bearing::gravity;
  double bearing_tolerance_rad = 0;  ///< azimuths this far on both sides of a bearing share it: fewer turns
  double settle_s = 7, exposure_s = 0.5;

  double tilt_rad(double phi_rad) const { return tilt_factor * phi_rad + tilt_offset_rad; }
};

/// Error{invalid_argument} naming the value; also where the trajectory would have more than kMaxPlannedStops.
LUMIHULL_API void check(const HemisphereOptions& options);

/// The stops of a mechanism, azimuth by azimuth from the zenith downwards, each with pose, lengths and bearing; whether
/// they can be reached is `judge_pose`'s. travel_s is 0. Names: "a012-e03", azimuth and row.
LUMIHULL_API std::vector<PlannedStop> hemisphere_stops(const Mechanism& mechanism, const HemisphereOptions& options);

/// The same for a camera on a turntable's arm, a tripod or in a hand: it looks straight at the centre, row by row from
/// phi_to upwards, every second row backwards. roll_rad: 0 landscape, pi/2 portrait.
LUMIHULL_API std::vector<PlannedStop> hemisphere_views(const HemisphereOptions& options, Orientation orientation);

/// A stop of a mechanism from its platform's pose and its bearing: lengths, camera's pose, azimuth and polar angle.
LUMIHULL_API PlannedStop platform_stop(const Mechanism& mechanism, const Eigen::Vector3d& center,
                                       const Pose& world_from_platform, double roll_rad);

/// A target on a wall: paper of size_m x size_m.
struct PlacedTarget {
  Eigen::Vector3d center, normal;  ///< world, m; normal towards who looks at it
  double size_m = 0.15;
};

/// Eight panels around the object and the floor between them (paper, 5.3), with targets at random places, uniform in
/// area; the same for a seed on every machine.
struct Enclosure {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the views
  double radius_m = 3;                               ///< to the panels
  double floor_m = -1, top_m = 2;                    ///< heights relative to the centre
  int panels = 8;
  int targets = 200;
  double target_size_m = 0.15;
  std::uint64_t seed = 1;
};
LUMIHULL_API std::vector<PlacedTarget> scatter_targets(const Enclosure& enclosure);

/// A list of targets: {"format": "lumihull-placed-targets", "version": 1, "targets": [{"center": [x, y, z], "normal":
/// [x, y, z], "size_m": s}, …]}, or a capture's targets.json. At most 100,000. Errors: not_found, io, bad_input.
LUMIHULL_API std::vector<PlacedTarget> read_placed_targets(const std::filesystem::path& file);

/// What counts as seen: wholly in the picture, not too oblique, not too small, not behind the object.
struct TargetSight {
  double largest_tilt_rad = 65 * std::numbers::pi / 180;
  double least_size_px = 30;
};
LUMIHULL_API int targets_in_view(const View& view, std::span<const PlacedTarget> targets, const ObjectSize& object,
                                 const Eigen::Vector3d& center, const TargetSight& sight = {});

}  // namespace lumihull::capture
