#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::calib {

/// A point of known place and where it was measured.
struct PointMatch {
  Eigen::Vector2d pixel{0, 0};
  Eigen::Vector3d world{0, 0, 0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< of pixel, px²
  /// A circle's centre: radius > 0, normal = unit normal of its plane; `pixel` is the ellipse's centre then.
  double radius = 0;
  Eigen::Vector3d normal{0, 0, 1};
};

struct LUMIHULL_API ResectOptions {
  bool robust = true;            ///< points may be wrong: minimal samples find the start, a robust loss weighs
  double outlier_sigma = 4;      ///< matches farther off than this many standard deviations (2-D) are named outliers
  int max_iterations = 20;
  std::uint64_t seed = 1;        ///< of the minimal samples

  void validate() const;
};

struct Resection {
  Pose cam_from_world;
  /// Of (rotation vector, translation) of a small motion applied after cam_from_world, in the camera's frame: rad, m.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<std::uint32_t> outliers;  ///< indices into the matches
  double rms_px = 0;                    ///< sqrt(Σ (dx² + dy²) / matches that count)
  double sigma0 = 0;                    ///< sqrt(Σ rᵀ Σ⁻¹ r / (2 n - 6)): about 1 where the covariances are right
  int iterations = 0;
};

/// The pose of one photograph from known points (paper, section 3.1; Hartley & Zisserman 2000, ch. 7): DLT for points in
/// general, homography for coplanar ones, minimal samples (P3P) where matches may be wrong; then the reprojection error is
/// minimised with analytic Jacobians.
///
/// At least 4 matches, in general position or coplanar (no three on a line). Errors: invalid_argument (fewer, not finite),
/// degenerate (collinear or repeated points, points behind the camera, two poses that fit equally well).
LUMIHULL_API Resection resect(const Camera& camera, std::span<const PointMatch> matches,
                              const ResectOptions& options = {});

/// The direct linear transform alone: M (3 x 4, pixels, no distortion) with sign such that depths are positive; >= 6
/// points that are not coplanar. Error{degenerate}.
LUMIHULL_API Eigen::Matrix<double, 3, 4> direct_linear_transform(std::span<const Eigen::Vector2d> pixels,
                                                                 std::span<const Eigen::Vector3d> world);

/// Homography (b from a) by the normalised DLT and refinement; >= 4 points, no three of which on a line. Error{degenerate}.
LUMIHULL_API Eigen::Matrix3d find_homography(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b);

}  // namespace lumihull::calib
