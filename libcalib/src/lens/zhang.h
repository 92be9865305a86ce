#pragma once

// Focal length and pose in closed form from homographies of planes (Zhang 2000) and from projection matrices.

#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <optional>
#include <span>

namespace lumihull::calib::lens {

/// What the closed form may assume.
struct ZhangOptions {
  bool free_aspect = false;  ///< else `aspect`
  double aspect = 1;         ///< focal length along u / along v
  bool free_center = true;   ///< else the principal point is the origin of the homographies' pixels
};

/// K (no skew) from homographies pixel_from_plane: each gives two equations in the image of the absolute conic
/// w = K⁻ᵀK⁻¹, h1ᵀ w h2 = 0 and h1ᵀ w h1 = h2ᵀ w h2 (Zhang 2000, eqs. 3 and 4); w's entries that the assumptions leave
/// free are the null vector of all of them (his section 3.1). Pixels should be about -1 … 1. nullopt where the equations
/// have no answer that is a camera: too few planes, planes all parallel, noise.
std::optional<Eigen::Matrix3d> zhang_camera(std::span<const Eigen::Matrix3d> pixel_from_plane,
                                            const ZhangOptions& options);

/// Pose of a plane from the homography ray_from_plane, rays (x, y, 1): columns r1, r2, t up to scale (Zhang 2000, section
/// 3.1), made orthogonal. `inside`: a point of the plane that is before the camera.
std::optional<Pose> pose_from_homography(const Eigen::Matrix3d& ray_from_plane, const Eigen::Vector2d& inside);

/// Pose from a projection matrix ray_from_body (3 x 4, up to scale, rays (x, y, 1)).
std::optional<Pose> pose_from_projection(const Eigen::Matrix<double, 3, 4>& ray_from_body,
                                         const Eigen::Vector3d& inside);

/// K (2,2) = 1, positive diagonal, of M = K [R t]; nullopt where M's left block is singular.
std::optional<Eigen::Matrix3d> camera_matrix_of(const Eigen::Matrix<double, 3, 4>& pixel_from_body);

}  // namespace lumihull::calib::lens
