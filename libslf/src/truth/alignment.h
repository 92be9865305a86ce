#pragma once

// From a capture's world to the truth's.

#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace lumihull::slf::truth {

/// truth = scale · motion.rotation · capture + motion.translation
struct Similarity {
  double scale = 1;
  Pose motion;

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return motion.rotation * (scale * p) + motion.translation;
  }

  /// A true camera as it stands in the capture's world, in the capture's unit.
  Pose in_capture(const Pose& cam_from_truth) const {
    const Pose p = cam_from_truth * motion;
    return {p.rotation, p.translation / scale};
  }
};

/// The similarity (`rigid`: scale 1) that brings points onto others with the least sum of squared distances (Umeyama
/// 1991). At least one; scale and turns that the points do not tell are 1 and arbitrary.
Similarity align_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to, bool rigid);

/// The same for cameras, whose rotations tell what centres on one line, or fewer than three, do not. nullopt where
/// nothing tells the scale: one camera, or all in one place.
struct CameraAlignment {
  Similarity truth_from_capture;
  bool by_rotations = false;
};
std::optional<CameraAlignment> align_cameras(std::span<const Pose> cam_from_capture,
                                             std::span<const Pose> cam_from_truth, bool rigid);

}  // namespace lumihull::slf::truth
