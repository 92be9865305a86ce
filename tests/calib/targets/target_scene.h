#pragma once

// Photographs of circle targets with known truth, for tests and benchmarks of the detector.

#include <lumihull/calib/detect_targets.h>
#include <lumihull/rig/flat_print.h>

#include <cstdint>
#include <random>
#include <vector>

namespace lumihull::test {

struct PlacedTarget {
  int design = 0;  ///< index into the designs
  int id = 0;
  Pose cam_from_target;
};

/// How a target lies before the camera.
struct Lie {
  Eigen::Vector2d pixel{0, 0};             ///< where its middle is seen
  double minor_px = 20;                    ///< full minor axis of the circle in the middle
  double tilt = 0, azimuth = 0, roll = 0;  ///< rad; tilt between line of sight and normal
};
Pose pose_of(const Camera& camera, const calib::TargetDesign& design, const Lie& lie);

Image photograph(const Camera& camera, const std::vector<calib::TargetDesign>& designs,
                 const std::vector<PlacedTarget>& targets, const Eigen::Vector3f& background,
                 const rig::PrintPhotoOptions& options, std::uint64_t seed);

/// A design by family name, its pitch 36 mm.
calib::TargetDesign design_of(const std::string& family);

/// A camera of a long lens, whose picture of width x height is a part far from the axis.
Camera part_of_camera(int width, int height, double f, const Eigen::Vector2d& principal_point);

/// One target in a picture that is just large enough, drawn from a seed.
struct OneTarget {
  Camera camera;
  PlacedTarget target;
  Image photo;
};
OneTarget one_target(const calib::TargetDesign& design, double minor_px, double tilt,
                     const rig::PrintPhotoOptions& options, std::uint64_t seed,
                     const Eigen::Vector3f& background = {.1f, .3f, .1f});

/// Where the centre of a circle's picture is.
Eigen::Vector2d true_center(const Camera& camera, const calib::TargetDesign& design, const PlacedTarget& truth,
                            int feature);

/// Root of the mean squared distance between measured centres and the truth, px; -1 without features.
double center_error(const Camera& camera, const calib::TargetDesign& design, const PlacedTarget& truth,
                    const calib::Detection& found);

}  // namespace lumihull::test
