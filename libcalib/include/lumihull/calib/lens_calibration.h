#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/base/pose.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::calib {

/// The parameters of a Camera in the order of Camera::project_with_parameter_jacobian.
enum class Intrinsic : std::uint8_t { f, s, skew, u0, v0, k1, k2, k3, p1, p2 };
inline constexpr int kIntrinsics = 10;
/// "f", "s", "skew", "u0", "v0", "k1", "k2", "k3", "p1", "p2"
LUMIHULL_API const std::array<std::string, kIntrinsics>& intrinsic_names();

/// A point on a calibration body and where it was measured in one photograph.
struct BoardMatch {
  Eigen::Vector2d pixel{0, 0};
  Eigen::Vector3d board{0, 0, 0};                            ///< m
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< px²
  double radius = 0;                                         ///< m; > 0: a circle, `pixel` is its ellipse's centre
  Eigen::Vector3d normal{0, 0, 1};                           ///< of the circle's plane
};

/// What one photograph shows of the calibration body.
struct BoardView {
  std::string name;
  std::vector<BoardMatch> matches;
};

struct LUMIHULL_API LensCalibrationOptions {
  /// Which parameters are estimated. The default: f, s = 1 fixed (square pixels), no skew, u0, v0, k1, k2, p1, p2.
  std::array<bool, kIntrinsics> free{true, false, false, true, true, true, true, false, true, true};
  /// Start for all parameters, and the value of those that are fixed; without: closed form, fixed ones 1 for s and 0.
  std::optional<Camera> start = std::nullopt;
  bool robust = true;        ///< Cauchy loss, then outliers are left out and named
  double outlier_sigma = 4;  ///< standard deviations (2-D), scaled by sigma0
  int max_iterations = 100;

  void validate() const;
};

struct LensCalibration {
  Camera camera;
  /// Of the ten parameters (zero rows for fixed ones), scaled by sigma0² where that is above 1.
  Eigen::Matrix<double, kIntrinsics, kIntrinsics> covariance = Eigen::Matrix<double, kIntrinsics, kIntrinsics>::Zero();
  std::vector<std::optional<Pose>> cam_from_board;  ///< a view; nullopt: it could not be used
  std::vector<std::string> problems;                ///< of views that could not be used, and weak geometry: what to do
  struct Residual {
    int view = 0, match = 0;
    Eigen::Vector2d error{0, 0};  ///< measured - predicted, px
    bool outlier = false;
  };
  std::vector<Residual> residuals;
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / points that count)
  double sigma0 = 0;  ///< residuals over their covariances: about 1
  /// Views split in two halves, each calibrated alone: largest difference of the two projections over the picture, px,
  /// and that difference over what the covariances expect (about 1). Negative: too few views.
  double cross_validation_px = -1, cross_validation_sigma = -1;
};

/// Calibrates a camera and its lens from photographs of a body of known points: closed-form start (planes: Zhang 2000;
/// 3-D: DLT), then minimisation of the reprojection error in pixels (Ceres) over all poses and the free parameters.
///
/// width, height: px of all photographs. Errors: invalid_argument (sizes, not finite), degenerate (too few views or
/// points; all views parallel: focal length and distance can't be told apart), cancelled.
LUMIHULL_API LensCalibration calibrate_lens(std::span<const BoardView> views, int width, int height,
                                            const LensCalibrationOptions& options, Job& job);

/// How uncertain a projection is: the standard deviation (px, the larger axis) of the pixel of a fixed ray at infinity,
/// once the rotation that best compensates for a change of the intrinsics over the picture is taken off; columns x rows
/// places, evenly over the picture, row-major.
LUMIHULL_API std::vector<double> projection_uncertainty(const LensCalibration& calibration, int columns, int rows);

/// A self-contained page: parameters, residuals over the picture, by distance from its middle and by view, the
/// uncertainty of projections. views: those that were calibrated from. Errors: invalid_argument (other views),
/// bad_input (camera).
LUMIHULL_API std::string lens_report_html(const LensCalibration& calibration, std::span<const BoardView> views,
                                          const std::string& title);

/// The photograph (as 8-bit RGB) with the points of the views that it shows: green crosses, orange ones for outliers, and
/// residuals (measured - predicted) magnified `magnify` times. shown: indices into `views`, which are those that were
/// calibrated from. Errors: invalid_argument (an empty picture, other views, not finite).
LUMIHULL_API Image draw_residuals(const Image& photo, const LensCalibration& calibration,
                                  std::span<const BoardView> views, std::span<const int> shown, double magnify = 100);

/// Text of a file ("lumihull-intrinsics", version 1): camera, covariance, what was measured. Errors: bad_input (a
/// problem's text is not UTF-8).
LUMIHULL_API std::string intrinsics_json(const LensCalibration& calibration);
/// Writes such a file. Errors: io, bad_input.
LUMIHULL_API void save_intrinsics(const std::filesystem::path& file, const LensCalibration& calibration);
/// Camera and covariance from such a file; the rest is empty. Errors: not_found, io, bad_input.
LUMIHULL_API LensCalibration load_intrinsics(const std::filesystem::path& file);

}  // namespace lumihull::calib
