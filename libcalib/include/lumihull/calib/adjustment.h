#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/base/pose.h>
#include <lumihull/calib/lens_calibration.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::calib {

/// A camera, or one of several on a rig: cam_from_world = cam_from_rig · rig_from_world of the shot.
struct AdjustedCamera {
  Camera camera;
  std::array<bool, kIntrinsics> free{};  ///< by Intrinsic; a parameter that is not free keeps its value
  Pose cam_from_rig;                     ///< identity where there is one camera only
  bool on_rig = false;                   ///< cam_from_rig is estimated; never true of a rig's first camera
};

/// A moment at which the rig, or the one camera, stood still.
struct AdjustedShot {
  std::string name;
  Pose rig_from_world;
};

/// What a body may do.
enum class BodyModel : std::uint8_t {
  rigid,    ///< six unknowns: the printed pattern moves as a whole
  bending,  ///< and bends along its z: a x² + b x y + c y² over its own extent, drawn to zero by `bend_sigma`
  free,  ///< three unknowns for each point, the printed pattern is only the start; circles turn and grow with its fit
};

/// A point of a body; a circle's centre where radius > 0.
struct BodyPoint {
  Eigen::Vector3d place{0, 0, 0};  ///< in the body's frame as printed, m
  double radius = 0;               ///< m
  Eigen::Vector3d normal{0, 0, 1};
};

/// Something with points on it that does not change while the photographs are taken: a target, a board, a lone point.
struct AdjustedBody {
  std::string name;
  std::vector<BodyPoint> points;
  BodyModel model = BodyModel::rigid;
  Pose world_from_body;           ///< in an answer's free bodies: the fit of the printed pattern to its points
  Eigen::Vector3d bend{0, 0, 0};  ///< a, b, c of BodyModel::bending, 1/m
  std::vector<Eigen::Vector3d> free_places;  ///< BodyModel::free: where the points are in the world; empty: as printed

  /// Where a point is in the world: of a rigid or bending body by its pose, bend and the print scale; of a free one its
  /// own place, as printed where `free_places` is empty.
  LUMIHULL_API Eigen::Vector3d point(std::size_t index, const Eigen::Vector2d& print_scale = {1, 1}) const;
};

struct Observation {
  std::uint32_t shot = 0, camera = 0, body = 0, point = 0;
  Eigen::Vector2d pixel{0, 0};                               ///< of a circle: the ellipse's centre
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< px²
};

/// A measured distance between two points.
struct ScaleBar {
  std::string name;
  std::uint32_t body_a = 0, point_a = 0, body_b = 0, point_b = 0;
  double length_m = 0, sigma_m = 0;
};

/// The unknowns with their start, and what was measured.
struct Adjustment {
  std::vector<AdjustedCamera> cameras;
  std::vector<AdjustedShot> shots;
  std::vector<AdjustedBody> bodies;
  std::vector<Observation> observations;
  std::vector<ScaleBar> bars;
  /// True length / length as printed of all patterns along their x and y, where `free_print_scale`: needs scale bars.
  Eigen::Vector2d print_scale{1, 1};
  bool free_print_scale = false;
};

struct LUMIHULL_API AdjustOptions {
  /// Cauchy loss with this scale, in standard deviations (2-D); 0: plain least squares.
  double robust_sigma = 0;
  double bend_sigma = 1;     ///< 1/m, a priori: 0.5 m radius of curvature
  int max_iterations = 50;   ///< 1 … 1000
  double tolerance = 1e-10;  ///< ends where a step changes the objective by less than this share
  bool covariances = true;

  void validate() const;
};

struct AdjustResult {
  Adjustment adjusted;
  /// Measured less predicted, px, of each observation; not a number where it can't be predicted. Observations that
  /// can't be predicted at the start (behind the camera, beyond the lens's domain) do not count.
  std::vector<Eigen::Vector2d> residuals;
  /// Σ rᵀ Σ⁻¹ r over both coordinates (robust: Σ of the loss), bars and bends included, before and after.
  double start_cost = 0, cost = 0;
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / observations that count)
  double sigma0 = 0;  ///< sqrt(Σ rᵀ Σ⁻¹ r / redundancy): about 1 where the covariances are right
  std::int64_t redundancy = 0;
  int iterations = 0;
  bool converged = false;

  /// Covariances (not scaled by sigma0) in the datum of inner constraints over the bodies: no mean shift, rotation or
  /// (where nothing fixes it) change of scale of their points against the answer. Empty where not asked for.
  /// Shots, cameras on the rig: of (rotation vector, translation) of a small motion applied after rig_from_world /
  /// cam_from_rig: rad, m.
  std::vector<Eigen::Matrix<double, 6, 6>> shot_covariances;
  std::vector<Eigen::Matrix<double, kIntrinsics, kIntrinsics>> camera_covariances;
  std::vector<Eigen::Matrix<double, 6, 6>> rig_covariances;
  Eigen::Matrix2d print_covariance = Eigen::Matrix2d::Zero();
  std::vector<std::vector<Eigen::Matrix3d>> point_covariances;  ///< of each body's points in the world, m²
};

/// Bundle adjustment: all unknowns together, such that predicted and measured pixels agree best (paper, section 3.1;
/// Triggs et al. 2000). Levenberg-Marquardt on the normal equations with analytic Jacobians through the lens (circles:
/// of the ellipses' centres); shots or bodies, whichever leaves the smaller system, are eliminated. The gauge is left
/// free and damped while iterating: nothing is held fixed, the answer is turned back to where the bodies' points were.
/// The same bytes for any number of threads.
///
/// Where nothing fixes the scale (all bodies free, no bars, no cameras fixed apart on the rig) it is the start's: that
/// at which the bodies' points lie closest to where they were. Points of free bodies that are not observed stay where
/// they are.
///
/// Errors: invalid_argument (indices, sizes, not finite), bad_input (camera), degenerate (a shot, body or point that
/// too little is seen of, parts of the photographs without a body in common: named), cancelled.
LUMIHULL_API AdjustResult adjust(const Adjustment& problem, const AdjustOptions& options, Job& job);

}  // namespace lumihull::calib
