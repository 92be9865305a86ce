#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
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
  bool robust = true;        ///< points may be wrong: minimal samples find the start, a robust loss weighs
  double outlier_sigma = 4;  ///< matches farther off, in standard deviations (2-D), are named outliers; 2 … 100
  int max_iterations = 20;   ///< of each run of least squares; 1 … 1000
  std::uint64_t seed = 1;    ///< of the minimal samples

  void validate() const;
};

struct Resection {
  Pose cam_from_world;
  /// Of (rotation vector, translation) of a small motion applied after cam_from_world, in the camera's frame: rad, m.
  /// From the matches' covariances; times sigma0² where that is above 1 by more than chance (99.9 % of its chi-square).
  /// With covariances that are only relative, scale it yourself.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<std::uint32_t> outliers;  ///< indices into the matches, ascending
  double rms_px = 0;                    ///< sqrt(Σ (dx² + dy²) / matches that count)
  double sigma0 = 0;  ///< sqrt(Σ rᵀ Σ⁻¹ r / (2 n - 6)): about 1 where the covariances are right
  int iterations = 0;

  /// Another pose, clearly different, that fits the same matches nearly as well: a small or distant plane seen almost
  /// without perspective can be tilted either way. Empty where there is none or it is refuted: 2 ln of the ratio of
  /// likelihoods, (2 n - 6) ln(alternative_chi2_ratio), is above 25 (odds of 250,000 to 1).
  std::optional<Pose> alternative;
  double alternative_chi2_ratio = 0;  ///< its Σ rᵀ Σ⁻¹ r over that of cam_from_world, >= 1
};

/// The pose of one photograph from known points (paper, section 3.1; Hartley & Zisserman 2000, ch. 7): DLT for points
/// in general, homography for coplanar ones, minimal samples (P3P) where matches may be wrong; then the reprojection
/// error, weighted by the matches' covariances, is minimised with analytic Jacobians through the lens. Circles meet the
/// ellipses' centres.
///
/// At least 4 matches at different places, not all on a line. With options.robust matches that don't fit are left out
/// and named, where at least 5 are given; a match counts as wrong beyond outlier_sigma x the residuals' robust scale.
/// Errors: bad_input (camera), invalid_argument (fewer, not finite), degenerate (repeated or collinear points, points
/// behind the camera, a mirrored world, no pose that the matches agree on). World points in any unit, anywhere.
LUMIHULL_API Resection resect(const Camera& camera, std::span<const PointMatch> matches,
                              const ResectOptions& options = {});

/// The direct linear transform alone: M (3 x 4, pixels, no distortion), scaled such that the third row gives positive
/// depths in the world's unit; >= 6 points that are not coplanar. Error{degenerate}.
LUMIHULL_API Eigen::Matrix<double, 3, 4> direct_linear_transform(std::span<const Eigen::Vector2d> pixels,
                                                                 std::span<const Eigen::Vector3d> world);

/// Homography (b from a) by the normalised DLT and refinement; >= 4 points, no three of which on a line. Norm 1;
/// the denominator is positive at the points. Errors: invalid_argument, degenerate.
LUMIHULL_API Eigen::Matrix3d find_homography(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b);

}  // namespace lumihull::calib
