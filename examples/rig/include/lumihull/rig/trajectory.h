#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lumihull::rig {

/// The paper's camera (sections 2.3, 5.4): 3072 x 2048 pixels on 22.7 x 15.1 mm, lenses of 10 and 18 mm.
inline constexpr double kFocalLength_mm = 18, kSensorWidth_mm = 22.7;

/// A camera `width` pixels wide (at least 2) and two thirds as high, with square pixels on a sensor of
/// `sensor_width_mm`. distortion: 1 is a lens with barrel (1.5 % at 18 mm, in normalised coordinates: more at 10 mm), a
/// principal point off the centre and .04 % of skewed aspect; 0 is ideal, in between is in between.
/// Error{invalid_argument} where a length is not positive.
Camera sensor_camera(int width, double focal_mm, double sensor_width_mm = kSensorWidth_mm, double distortion = 1);
/// The paper's with its 18 mm lens.
Camera default_camera(int width = 3072, bool distortion = true);

/// The distance at which a ball fills `fill` of the picture's smaller side.
double framing_distance(const Camera& camera, double ball_radius, double fill = 0.85);

/// Where cameras go around a target; angles in radians, z up.
struct Hemisphere {
  Eigen::Vector3d target{0, 0, 0};
  double radius = 1;                         ///< m
  double phi_first = 0.12, phi_last = 1.45;  ///< polar angle: 0 = from above, pi/2 = from the side
  double jitter = 0.01;                      ///< how far a shot is from its commanded place: part of radius; also aim
  std::uint64_t seed = 1;
};

/// `n` shots in a grid of phi x theta, one azimuth after another from top to bottom (paper, section 2.2);
/// cam_from_world.
std::vector<Pose> hemisphere_trajectory(int n, const Hemisphere& options);
/// `n` shots at polar angle phi_last, evenly around.
std::vector<Pose> ring_trajectory(int n, const Hemisphere& options);
/// `n` shots uniform over the part of the sphere between phi_first and phi_last, rolled by any angle.
std::vector<Pose> random_trajectory(int n, const Hemisphere& options);
/// `n` shots along a smooth arc as a hand would lead the camera: azimuth evenly over 120° around `theta_middle`, polar
/// angle down and up again through the middle half of phi_first … phi_last; seen from nearby by the trajectories above,
/// from nowhere on it exactly. jitter counts as for them.
std::vector<Pose> arc_trajectory(int n, const Hemisphere& options, double theta_middle);

}  // namespace lumihull::rig
