#pragma once

// Calibration bodies, a camera that looks at them, and exact or noisy measurements.

#include <lumihull/calib/lens_calibration.h>

#include <random>
#include <vector>

namespace lumihull::test {

/// columns x rows points of a plane, `spacing` apart, row-major from (0, 0, 0).
std::vector<Eigen::Vector3d> plane_points(int columns, int rows, double spacing);

/// Points on three faces of a box's corner: a 3-D body.
std::vector<Eigen::Vector3d> box_points(int side, double spacing);

/// A camera with about the distortion of a wide lens, all ten parameters off their defaults but s and skew.
Camera wide_camera();

/// How the views are made.
struct ViewMaker {
  Camera camera;
  std::vector<Eigen::Vector3d> body;
  double distance = 0;  ///< of the body's middle, m; 0: so that it fills most of the picture
  double tilt = 0.7;    ///< largest angle between axis and normal, rad
  double noise = 0;     ///< px
  double radius = 0;    ///< of circles in the plane z = 0; 0: points
};

/// Deterministic for a seed. Points beyond the picture are left out, covariances are noise² (1 px² without noise).
/// poses: cam_from_board of each, if wanted.
std::vector<calib::BoardView> make_views(const ViewMaker& maker, int count, std::uint64_t seed,
                                         std::vector<Pose>* poses = nullptr);

/// Largest difference over the picture between two cameras' pixels for the same rays, px.
double largest_difference(const Camera& a, const Camera& b);

}  // namespace lumihull::test
