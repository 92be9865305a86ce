#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>

#include <Eigen/Core>
#include <optional>

namespace lumihull::calib {

/// A circle in space.
struct Circle3 {
  Eigen::Vector3d center{0, 0, 0};
  Eigen::Vector3d u{1, 0, 0}, v{0, 1, 0};  ///< in-plane, orthonormal
  double radius = 0;
};

/// Where the *measured centre* of a circle's picture is: the centre of the ellipse, not the picture of the centre.
///
/// Without distortion B = [X;1][X;1]ᵀ - R² ([u;0][u;0]ᵀ + [v;0][v;0]ᵀ), C* = P B Pᵀ (Hartley & Zisserman 2000, 8.3), centre
/// = (C*02, C*12) / C*22. Through a lens the contour is no conic: the prediction is the dual-conic operator's answer for the
/// distorted tangent lines.
///
/// circle: in the camera's frame. jacobian: d pixel / d (camera-frame rigid motion: rotation vector about the camera's
/// origin, translation), 2 x 6. nullopt where part of the circle is behind the camera or beyond the lens's domain.
LUMIHULL_API std::optional<Eigen::Vector2d> projected_circle_center(const Camera& camera, const Circle3& circle,
                                                                    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

/// The same for a plane: where the centre of a circle of radius `radius` about `center` (plane's coordinates) is measured
/// through a homography pixel_from_plane.
LUMIHULL_API Eigen::Vector2d homography_circle_center(const Eigen::Matrix3d& pixel_from_plane,
                                                      const Eigen::Vector2d& center, double radius);

}  // namespace lumihull::calib
