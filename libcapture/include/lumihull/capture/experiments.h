#pragma once

#include <lumihull/capture/planner.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// How well the robot comes back (paper, 5.2): `visits` rounds over the four corners of a horizontal square, in turn.
struct RepeatabilityOptions {
  Eigen::Vector3d center{0, 0, 0};  ///< of the square, world, m
  double side_m = 3;
  int visits = 25;
  double settle_s = 7, exposure_s = 0.5;
  PoseLimits limits;
};

/// Stops "p0-v00", "p1-v00", … with the platform level and the bearing locked at 0. Errors: invalid_argument;
/// degenerate (a corner or the way to the next one can't be taken: why).
LUMIHULL_API Plan repeatability_plan(const Mechanism& mechanism, const RepeatabilityOptions& options);

/// Measured poses of one place about their mean.
struct PoseSpread {
  Pose mean;                       ///< mean position; mean rotation after Markley et al. 2007
  std::vector<double> distance_m;  ///< of each pose's position from the mean one
  std::vector<double> angle_rad;   ///< of each pose's rotation from the mean one
  double largest_distance_m = 0, largest_angle_rad = 0;
};
/// Poses as world_from_camera, in any frame. Error{invalid_argument} without poses, or where one is not finite.
LUMIHULL_API PoseSpread pose_spread(std::span<const Pose> world_from_camera);

/// The time after which a displacement stays within `allowed` to both sides (paper, 5.1); nullopt where the last
/// sample is beyond. `time_s` ascends. Error{invalid_argument}: lists of different or no length, values not finite.
LUMIHULL_API std::optional<double> settle_time_s(std::span<const double> time_s, std::span<const double> displacement,
                                                 double allowed);

/// Distances and angles of all visits, place by place; displacement over time with the allowed band. As SVG files of
/// their own.
LUMIHULL_API std::string repeatability_svg(std::span<const PoseSpread> places);
LUMIHULL_API std::string stability_svg(std::span<const double> time_s, std::span<const double> displacement_px,
                                       double allowed_px);

}  // namespace lumihull::capture
