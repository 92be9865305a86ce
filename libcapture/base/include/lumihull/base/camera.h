#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <optional>

namespace lumihull {

using Matrix23d = Eigen::Matrix<double, 2, 3>;

/// Camera with Heikkilä's lens model.
///
/// Projection (paper, eq. 7, with a skew): u = s f x_d + skew y_d + u0, v = f y_d + v0, where (x_d, y_d) is the
/// *distorted* normalised image point. Lens (paper, eq. 8; Heikkilä 2000, in normalised coordinates): with r² = x² + y²
///
///     F_x = x (k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
///     F_y = y (k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
///     corrected = distorted + F(distorted)
///
/// so the polynomial goes from the picture to the ray: the reverse of OpenCV's and COLMAP's direction.
/// Pixels: the centre of the first one is (0.5, 0.5). The principal point may lie outside the picture.
struct LUMIHULL_API Camera {
  int width = 0, height = 0;  ///< px
  double f = 0;               ///< focal length along v, px, > 0
  double s = 1;               ///< aspect: the focal length along u is s f, > 0
  double skew = 0;            ///< px
  double u0 = 0, v0 = 0;      ///< principal point, px
  double k1 = 0, k2 = 0, k3 = 0, p1 = 0, p2 = 0;

  bool has_distortion() const { return k1 != 0 || k2 != 0 || k3 != 0 || p1 != 0 || p2 != 0; }
  Eigen::Matrix3d matrix() const;  ///< K of eq. 7, upper triangular

  /// Throws Error{bad_input} naming the first field that is not finite or out of range.
  void validate() const;

  /// corrected from distorted, both normalised; jacobian (2 x 2) if wanted. Any finite argument.
  Eigen::Vector2d correct(const Eigen::Vector2d& distorted, Eigen::Matrix2d* jacobian = nullptr) const;

  /// distorted from corrected: the exact inverse (residual <= 1e-12), on the branch that contains the origin.
  /// nullopt where the model is not one-to-one (beyond the fold): never a point of the folded branch.
  /// Start: Heikkilä's closed form (2000, eq. 16 ff., extended to k3); then safeguarded Newton steps, at most 10 from
  /// there before a continuation along the ray takes over.
  std::optional<Eigen::Vector2d> distort(const Eigen::Vector2d& corrected, Eigen::Matrix2d* jacobian = nullptr) const;

  Eigen::Vector2d pixel_from_distorted(const Eigen::Vector2d& d) const {
    return {s * f * d.x() + skew * d.y() + u0, f * d.y() + v0};
  }
  Eigen::Vector2d distorted_from_pixel(const Eigen::Vector2d& px) const {
    const double y = (px.y() - v0) / f;
    return {(px.x() - u0 - skew * y) / (s * f), y};
  }

  /// Pixel of a point in the camera's frame; nullopt behind the camera (z <= 0) or beyond the lens model's domain.
  /// The pixel may lie outside the picture. jacobian: d pixel / d point.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Matrix23d* jacobian = nullptr) const;

  /// d pixel / d (f, s, skew, u0, v0, k1, k2, k3, p1, p2) at a point (columns 0 … 9), by implicit differentiation of
  /// the lens's inverse. false where `project` has no answer.
  bool project_with_parameter_jacobian(const Eigen::Vector3d& point, Eigen::Vector2d* pixel, Matrix23d* by_point,
                                       Eigen::Matrix<double, 2, 10>* by_parameters) const;

  /// Direction (x, y, 1) in the camera's frame that a pixel sees; not normalised. nullopt for a pixel beyond the lens
  /// model's domain.
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& pixel) const;

  /// Largest radius of *distorted* normalised coordinates up to which `correct` is one-to-one in every direction;
  /// infinity for a lens without fold.
  double domain_radius() const;

  /// Whether a pixel is inside the picture: 0 <= u <= width, 0 <= v <= height.
  bool contains(const Eigen::Vector2d& px) const {
    return px.x() >= 0 && px.y() >= 0 && px.x() <= width && px.y() <= height;
  }
};

/// A camera at a place: what is needed to project a world point into one photograph.
struct View {
  Camera camera;
  Pose cam_from_world;

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& world) const {
    return camera.project(cam_from_world * world);
  }
  Eigen::Vector3d center() const { return cam_from_world.center(); }
};

}  // namespace lumihull
