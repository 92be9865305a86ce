#pragma once

// Parts of calibration.html, each an HTML text of its own.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/target_model.h>

#include <Eigen/Core>
#include <string>

namespace lumihull::calib::report {

/// Covariance of a placed camera's centre in the world, m²: with the motion (ω, τ) after cam_from_world the centre
/// moves by -Rᵀ τ to first order.
inline Eigen::Matrix3d center_covariance(const CalibratedPhoto& photo) {
  const Eigen::Matrix3d world_from_cam = photo.cam_from_world->rotation.toRotationMatrix().transpose();
  return world_from_cam * photo.covariance.bottomRightCorner<3, 3>() * world_from_cam.transpose();
}

/// Standard deviation along the longest axis, from a covariance.
double longest_axis(const Eigen::Matrix3d& covariance);

/// Cameras and targets in space with their uncertainty: one view that turns with the pointer, one from above, one from
/// the side. Empty where nothing is placed.
std::string scene(const TargetModel& model);
/// What the scene's script needs, once a page.
std::string scene_script();

/// For each camera: where in the picture it was measured, and what residuals are left there.
std::string over_the_picture(const TargetModel& model);
/// Residuals by photograph, by target and, where there are circles, by their size.
std::string by_thing(const TargetModel& model);
/// The photographs that fit worst, with their residuals magnified. Counts a step of the job for each.
std::string worst_photographs(const Capture& capture, const TargetModel& model, Job& job);
/// How many worst_photographs shows at most.
inline constexpr int kWorstShown = 4;

}  // namespace lumihull::calib::report
