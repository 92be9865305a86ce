// Detections of a capture of known truth: a camera on a hemisphere in an enclosure with coded targets.
#pragma once

#include <lumihull/calib/calibrate.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace lumihull::test {

struct SimulatedOptions {
  int photos = 60, targets = 40;
  double radius_m = 2.7, room_m = 3;  ///< of the cameras' hemisphere, of the cylinder of walls
  double noise_px = 0.05;             ///< standard deviation of each coordinate, which the covariances say, too
  double s = 1, k3 = 0;               ///< of the lens, beside its k1, k2, p1, p2
  const char* family = "matrix5x5:36mm";
  bool floor_only = false;  ///< all targets on the floor, as on a sheet
  std::uint64_t seed = 1;
};

/// What is seen, and the truth.
struct SimulatedCapture {
  calib::TargetSet set;
  Camera camera;
  std::vector<Pose> world_from_target;  ///< by id
  std::vector<Pose> cam_from_world;     ///< by photograph
  std::vector<calib::PhotoTargets> photos;

  std::vector<calib::CameraStart> cameras(bool known) const;
};

SimulatedCapture simulate_capture(const SimulatedOptions& options);

/// A detection of a target as a camera sees it; nullopt where not all of it is seen, or too obliquely.
std::optional<calib::Detection> see_target(const calib::TargetSet& set, int id, const Pose& world_from_target,
                                           const View& view, double noise_px, std::uint64_t seed);

/// RMS distance of camera centres, m, and angle, rad, after the best rigid motion of the answer onto the truth.
struct PoseErrors {
  double centre_m = 0, angle = 0;
  int photos = 0;
};
PoseErrors pose_errors(const SimulatedCapture& truth, const calib::Calibration& answer);

}  // namespace lumihull::test
