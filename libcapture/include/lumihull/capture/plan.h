#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/mechanism.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::capture {

/// One stop of the robot: what is photographed there.
struct PlannedStop {
  std::string name;               ///< unique; photographs are named after it, e.g. "a012-e03"
  double theta_rad = 0;           ///< azimuth of the view on the hemisphere
  double phi_rad = 0;             ///< from the zenith (0) to the horizon (pi/2)
  double roll_rad = 0;            ///< the camera's bearing: 0 landscape, pi/2 portrait
  Pose world_from_platform;       ///< of a mechanism; for turntables and hands the wanted pose of the camera's carrier
  Pose cam_from_world;            ///< commanded; never taken for measured
  std::vector<double> lengths_m;  ///< of the cables; empty without a mechanism
  double travel_s = 0;            ///< from the stop before
  double settle_s = 7;            ///< swing dies out (paper, 2.3)
  double exposure_s = 0.5;        ///< at most 2 s in the paper
};

/// What `lumihull plan` writes and `lumihull capture` carries out, in this order.
struct Plan {
  std::string robot;                   ///< "cables", "turntable", "hand"
  std::optional<Mechanism> mechanism;  ///< for "cables"
  std::optional<KeepOut> object;       ///< no part of the robot may enter it
  std::vector<std::string> cameras;    ///< names, one photograph a stop and camera; at least one
  std::vector<PlannedStop> stops;
};

/// Error{bad_input} with `subject`: names used twice or no plain file names, values not finite, negative times, lengths
/// that are not those of the pose (beyond 1 µm) or outside a cable's limits.
LUMIHULL_API void check(const Plan& plan, const std::string& subject = "plan");

/// plan.json ("format": "lumihull-plan"). Errors: not_found, io, bad_input naming file, pointer, expectation.
LUMIHULL_API Plan read_plan(const std::filesystem::path& file);
LUMIHULL_API void write_plan(const Plan& plan, const std::filesystem::path& file);

}  // namespace lumihull::capture
