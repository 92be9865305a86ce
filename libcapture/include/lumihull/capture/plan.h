#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/mechanism.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::capture {

/// One stop of the robot: what is photographed there, or a place that it passes on its way.
struct PlannedStop {
  std::string name;               ///< unique; photographs are named after it, e.g. "a012-e03"
  double theta_rad = 0;           ///< azimuth of the view on the hemisphere
  double phi_rad = 0;             ///< from the zenith (0) to the horizon (pi/2)
  double roll_rad = 0;            ///< the camera's bearing (Mechanism::cam_from_platform); set when the stop is reached
  Pose world_from_platform;       ///< of a mechanism; for turntables and hands the wanted pose of the camera itself
  Pose cam_from_world;            ///< commanded; never taken for measured
  std::vector<double> lengths_m;  ///< of the cables; empty without a mechanism
  double travel_s = 0;            ///< from the stop before; a change of the bearing is not in it
  double settle_s = 7;            ///< swing dies out (paper, 2.3)
  double exposure_s = 0.5;        ///< at most 2 s in the paper; 0 where nothing is photographed
  bool photograph = true;         ///< false: on the way round an obstacle, or where the camera is turned
  std::string pause;              ///< what the operator is asked to do before the robot goes there; else empty
};

constexpr std::size_t kMaxPlannedStops = 100'000;
constexpr std::size_t kMaxPlannedCameras = 16;

/// What `lumihull plan` writes and `lumihull capture` carries out, in this order.
struct Plan {
  std::string robot;                   ///< "cables", "turntable", "hand"
  std::optional<Mechanism> mechanism;  ///< for "cables"
  std::optional<KeepOut> object;       ///< no part of the robot may enter it
  std::vector<std::string> cameras;    ///< names, one photograph a stop and camera; at least one
  std::vector<PlannedStop> stops;      ///< at least one that is photographed
};

/// Error{bad_input} with `subject`: names used twice or no plain file names, values not finite, negative times, lengths
/// that are not those of the pose (beyond 1 µm) or outside a cable's limits, too many stops or cameras.
LUMIHULL_API void check(const Plan& plan, const std::string& subject = "plan");

/// Travel, settling and exposures of all stops, s; an operator's pauses are not in it.
LUMIHULL_API double duration_s(const Plan& plan);

/// plan.json ("format": "lumihull-plan"). Errors: not_found, io, bad_input naming file, pointer, expectation.
LUMIHULL_API Plan read_plan(const std::filesystem::path& file);
LUMIHULL_API void write_plan(const Plan& plan, const std::filesystem::path& file);

}  // namespace lumihull::capture
