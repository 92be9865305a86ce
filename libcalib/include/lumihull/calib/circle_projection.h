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
/// Without distortion B = [X;1][X;1]ᵀ - R² ([u;0][u;0]ᵀ + [v;0][v;0]ᵀ), C* = P B Pᵀ (Hartley & Zisserman 2000, 8.3),
/// centre = (C*02, C*12) / C*22: the picture of the point X - (R²/z) (e₃ - n n_z). Through a lens the contour is no
/// conic: the prediction is the centre of the ellipse that lies closest to the distorted contour (squared distances
/// along the normal, by arc length), which is what `fit_ellipse` and, with weights of its own, the dual-conic operator
/// see. Where a circle is seen from so near its edge that nobody measures it (ratio of the axes below about a fifth)
/// the contour may be bent by as much as it is wide; from 0.2 to 0.12 the prediction goes over, smoothly, into the picture of
/// the point above, which lies off by what distortion bends the contour by.
///
/// circle: in the camera's frame; u, v orthonormal. jacobian: d pixel / d (camera-frame rigid motion: rotation vector
/// about the camera's origin, translation), 2 x 6. by_parameters: d pixel / d (f, s, skew, u0, v0, k1, k2, k3, p1, p2),
/// 2 x 10. Both neglect terms of (departure of the contour from an ellipse) / radius, < 1e-3 of their size.
/// nullopt where part of the circle is behind the camera or beyond the lens's domain. Radius 0: the point's projection.
LUMIHULL_API std::optional<Eigen::Vector2d> projected_circle_center(
    const Camera& camera, const Circle3& circle, Eigen::Matrix<double, 2, 6>* jacobian = nullptr,
    Eigen::Matrix<double, 2, 10>* by_parameters = nullptr);

/// The same for a plane: where the centre of a circle of radius `radius` about `center` (plane's coordinates) is
/// measured through a homography pixel_from_plane. Not a number where the circle meets the line that is seen at
/// infinity.
LUMIHULL_API Eigen::Vector2d homography_circle_center(const Eigen::Matrix3d& pixel_from_plane,
                                                      const Eigen::Vector2d& center, double radius);

}  // namespace lumihull::calib
