#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/evaluate.h>

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::slf {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Some lengths or angles, >= 0. Without any: zeros and NaN.
struct Spread {
  std::size_t count = 0;
  double mean = kUnknown, rms = kUnknown, median = kUnknown, q95 = kUnknown, max = kUnknown;
};

struct LUMIHULL_API TruthOptions {
  std::size_t surface_samples = 100'000;  ///< points on each surface, evenly by area; 1000 … 10,000,000
  double outside_mm = 1;                  ///< true surface farther outside of the hull than this counts as cut away
  int silhouette_views = 64;              ///< photographs in which the hull's outline is judged, evenly chosen; >= 1
  int silhouette_side_px = 960;           ///< larger pictures are judged at so many pixels of their longer side; >= 16
  RenderOptions render{3, false};         ///< of test views
  LumigraphOptions lumigraph;
  bool pictures =
      true;  ///< write reference | rendering | difference of test views to evaluate/test_views/ in the capture

  void validate() const;
};

/// Camera poses against the true ones, after alignment.
struct PoseTruth {
  struct Shot {
    std::string name;
    double center_mm = 0, rotation_deg = 0;
    double mahalanobis2 = kUnknown;  ///< of its six errors, over the stated covariance
  };
  /// truth = scale · rotation · capture + translation. The sum of the squared distances of the camera centres is least
  /// (Umeyama 1991; scale 1 where the capture's unit is known); where they lie on one line or are fewer than three:
  /// the mean of the cameras' rotations, then the centres.
  double scale = 1;
  Pose motion;  ///< rotation, translation of the above
  bool aligned_by_rotations = false;
  /// By how much the capture is too large, parts per million, where its unit is known: how a similarity would differ.
  double scale_error_ppm = kUnknown;
  Spread center_mm, rotation_deg;
  /// Σ Mahalanobis² / degrees of freedom: about 1 where the stated covariances are right. In the datum in which they
  /// are stated (the targets' points at rest) where the targets' truth is known; else the cameras themselves are
  /// aligned, weighted by their covariances, and six degrees of freedom (seven where the unit is unknown) taken off.
  double consistency = kUnknown;
  bool consistency_by_targets = false;
  std::vector<Shot> shots;
  std::vector<std::string> not_placed;      ///< true views whose shot has no pose
  std::vector<std::string> not_in_truth;    ///< shots that the truth does not know
  std::vector<std::string> not_in_capture;  ///< true views that are no shots
};

/// A camera against the true one.
struct LensTruth {
  int camera = 0;
  double focal_error_percent = 0;            ///< of f
  Eigen::Vector2d principal_point_px{0, 0};  ///< the capture's less the true one
  /// Between the pixels of a fixed ray at infinity by both lenses, over the picture, once the rotation of the camera
  /// that takes most of it off is taken off.
  double projection_rms_px = 0, projection_max_px = 0;
};

/// Targets as solved against where they hang, after the alignment of the poses.
struct TargetTruth {
  struct Target {
    std::string name;
    int design = 0, id = 0;
    double rms_mm = 0;  ///< of its points
  };
  std::vector<Target> targets;
  Spread point_mm;  ///< of all points of all targets
  /// Solved targets that do not exist, or that are nearer to another target's true place than to their own.
  std::vector<std::string> wrong_ids;
  std::vector<std::string> not_solved;  ///< that hang in the room, but were not placed
};

/// A silhouette against the true one. Edges are the 127.5 levels of the soft masks, between the centres of pixels;
/// distances are weighted by the edge's length, in both directions, and end at 64 px.
struct MaskTruth {
  struct Shot {
    std::string name;
    double iou = 0;
    Spread edge_px;
    double within = 0;   ///< share of the edges (both) within kEdgePx of the other one
    double bias_px = 0;  ///< (area - true area) / length of the true edge: positive where the mask is too large
    std::size_t holes = 0, hole_px = 0;      ///< background that the object encloses, most of which is object in truth
    std::size_t islands = 0, island_px = 0;  ///< object apart from the rest, most of which is background in truth
  };
  static constexpr double kEdgePx = 1.5;
  std::vector<Shot> shots;
  double iou_mean = 0, iou_least = 0;
  Spread edge_px;  ///< over all shots
  double within = 0, bias_px = 0;
  std::size_t holes = 0, islands = 0;
  std::vector<std::string> without_truth;  ///< shots with a mask that have no true one
};

/// The hull against the true surface, after the alignment of the poses.
struct SurfaceTruth {
  Spread hull_to_truth_mm,
      truth_to_hull_mm;            ///< of points evenly over the one surface, from the other; max: Hausdorff's
  double voxel_mm = kUnknown;      ///< longest side of the hull's region / resolution, about
  double volume_ratio = kUnknown;  ///< hull / truth
  double outside_mm = 0;           ///< TruthOptions::outside_mm
  double outside_share = 0;        ///< of the true surface, farther outside of the hull than that
  double outside_max_mm = 0;
  struct Shot {
    std::string name;
    double iou = 0;
  };
  std::vector<Shot> silhouettes;  ///< of hull and true mesh, both rendered by the true cameras
  double iou_mean = kUnknown, iou_least = kUnknown;
};

/// A capture beside the truth about it.
struct TruthComparison {
  std::string truth;                  ///< the folder
  std::vector<std::string> left_out;  ///< what could not be compared, and why; a line each
  std::optional<PoseTruth> poses;
  std::vector<LensTruth> lenses;
  std::optional<TargetTruth> targets;
  std::optional<MaskTruth> masks;
  std::optional<SurfaceTruth> surface;
  std::optional<TestViewEvaluation> views;

  /// One JSON object with the members' names; lists by shot and target within. NaN becomes null.
  LUMIHULL_API std::string to_json() const;
  /// The main figures, a line each.
  LUMIHULL_API std::vector<std::string> summary() const;
};

/// Compares what a capture holds with a folder of truth as the virtual rig writes it (examples/rig/README.md), in
/// metres:
///
///     cameras.json     "lumihull-rig-truth", or "lumihull-cameras" with one camera: intrinsics, poses
///     targets.json     "lumihull-rig-targets": where each target hangs
///     masks/NAME.png   silhouettes                    mesh.ply   the surface
///     test_views.json, test_views/NAME.png, test_views/masks/NAME.png   new views
///     test_views/without_highlights/NAME.png, test_views/highlights/NAME.png   their highlights (HighlightJudge)
///
/// What either side does not have is left out and named; without cameras.json only masks can be compared, for the two
/// worlds are not known to be one. The world of the truth may differ from the capture's by a motion, and by a scale
/// where the capture's unit is unknown. Masks are read one a thread at a time. The same bytes for any number of
/// threads.
///
/// Errors: not_found (no such folder; none of these files in it), bad_input (a file that is damaged or contradicts the
/// capture or another file: sizes, names; names what was expected), invalid_argument (options), cancelled.
LUMIHULL_API TruthComparison compare_with_truth(const Capture& capture, const std::filesystem::path& truth,
                                                const TruthOptions& options, Job& job);

/// A page without external resources: all figures, how they spread, and the worst cases in pictures.
/// Errors: bad_input, not_found, io (a photograph or mask of a worst case), cancelled.
LUMIHULL_API std::string truth_html(const Capture& capture, const TruthComparison& comparison, Job& job);

}  // namespace lumihull::slf
