#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/capture/planner.h>

#include <cstddef>
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

/// A place that a capture's robot was told to go to several times.
struct RepeatedPlace {
  std::string name;                      ///< the first visit's stop, and the camera where there are several
  std::vector<std::string> photographs;  ///< visits whose pose was measured, in the capture's order
  PoseSpread spread;                     ///< of these
};

/// How well the robot came back (paper, 5.2 and fig. 9).
struct Repeatability {
  std::vector<RepeatedPlace> places;      ///< with at least two measured visits
  std::vector<std::string> without_pose;  ///< photographs of repeated places that calibration could not place
  std::size_t visits = 0;                 ///< over all places
  double largest_distance_m = 0, largest_angle_rad = 0;
  double rms_distance_m = 0, rms_angle_rad = 0;  ///< over all visits
  /// RMS over all visits of how well calibration knows a pose: its part in the spread. Negative: no covariances.
  double measured_m = -1, measured_rad = -1;
};

/// From a calibrated capture: photographs by one camera with the same commanded pose are visits of a place.
/// Error{bad_input} naming the capture: no scale (its unit is not metres), or no place with two measured visits.
LUMIHULL_API Repeatability repeatability(const Capture& capture);
/// {"places": [{"name", "photographs", "distances_m", "angles_rad", "largest_distance_m", "largest_angle_rad"}],
///  "without_pose", "visits", "largest_distance_m", …}
LUMIHULL_API std::string describe_json(const Repeatability& found);
/// A page: figures in numbers, distances and angles of all visits (fig. 9).
LUMIHULL_API std::string repeatability_html(const Repeatability& found, const std::string& title);

/// A target's way through a film that begins where the robot's command ended (paper, 5.1).
struct Stability {
  std::vector<double> time_s;
  std::vector<Eigen::Vector2d> offset_px;  ///< from where the target rests: the mean of the film's end
  std::vector<double> distance_px;         ///< length of each
  double allowed_px = 0;
  std::optional<double> settle_s;  ///< from then on within allowed_px; nullopt: it was not at the end
  double rest_px = 0;              ///< RMS distance over the film's end: what is left, and how well it is measured
};
/// center_px: where the target is at each time. rest_s: the film's end that counts as rest, from its last time back.
/// Error{invalid_argument}: as settle_time_s; rest_s that holds fewer than three pictures.
LUMIHULL_API Stability stability(std::span<const double> time_s, std::span<const Eigen::Vector2d> center_px,
                                 double allowed_px = 0.5, double rest_s = 2);
/// {"time_s", "offset_px", "distance_px", "allowed_px", "settle_s" (null: not at the end), "rest_px"}
LUMIHULL_API std::string describe_json(const Stability& found);

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
