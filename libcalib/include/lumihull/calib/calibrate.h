#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/base/pose.h>
#include <lumihull/calib/adjustment.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/target_set.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::calib {

/// What was found in one photograph.
struct PhotoTargets {
  std::string name;
  int shot = 0;    ///< photographs of several cameras of one rig at one moment have the same number
  int camera = 0;  ///< index into the cameras
  std::vector<Detection> targets;
};

/// A camera before calibration.
struct CameraStart {
  int width = 0, height = 0;  ///< px
  /// What is known of it; without: from `focal_px`, or from the targets themselves (calibrate_lens).
  std::optional<Camera> camera;
  double focal_px = 0;  ///< a first guess, from EXIF; 0: none
};

struct LUMIHULL_API CalibrateOptions {
  /// Intrinsics are refined in the adjustment; else those of CameraStart::camera are kept, and must be there.
  bool refine_intrinsics = true;
  std::array<bool, kIntrinsics> free{true, false, false, true, true, true, true, false, true, true};  ///< by Intrinsic
  /// s and k3 are refined, too, where the residuals clearly ask for them: a lens that has them would otherwise push out
  /// good photographs, for what a few terms leave over is a hundred times what targets are measured to.
  bool more_if_needed = true;
  BodyModel model = BodyModel::rigid;  ///< of targets and boards
  bool rig = false;                    ///< several cameras are fixed to each other; `shot` says what belongs together
  /// Photographs that the model of the targets is made from; the rest is placed by resection (paper, 3.1) and joins the
  /// last adjustment. 0: all of them make the model.
  int model_photos = 150;
  double outlier_sigma = 4;    ///< observations farther off, in standard deviations (2-D), are removed and named
  std::vector<ScaleBar> bars;  ///< body_a, body_b: indices into `bodies_of(set, …)`'s answer
  bool free_print_scale = false;
  bool cross_validate = true;

  void validate() const;
};

/// Something that was left out, and why. Empty or negative fields: it concerns all of them.
struct Removed {
  enum class Kind : std::uint8_t { observation, detection, target, photo };
  enum class Why : std::uint8_t {
    outlier,        ///< an observation beyond outlier_sigma
    wrong_id,       ///< a target where the model has none: misread, or another one with that id
    moved,          ///< seen in one place in a run of photographs, and in another one in the rest
    same_id,        ///< two targets with one id, seen in different photographs in turn
    other_scene,    ///< a photograph whose targets do not lie to each other as the model's do
    mirrored,       ///< a photograph that was taken in a mirror, or flipped
    too_few,        ///< a photograph with too few points, or a target seen too rarely to be placed
    not_connected,  ///< in another part than the largest: no chain of shared targets leads there
    unknown_board,  ///< a target that is on no board of the set
  };
  Kind kind = Kind::observation;
  Why why = Why::outlier;
  int photo = -1;  ///< index into the photographs
  int body = -1;   ///< index into Calibration::bodies
  int design = -1, id = -1, feature = -1;
  double off_px = 0;  ///< how far from where it should be, where that is known
  std::string text;   ///< one line that names photograph and target and says what it means
};

struct CalibratedPhoto {
  std::optional<Pose> cam_from_world;  ///< of photographs of part 0
  /// In the frame of a smaller part, whose place in the world nothing tells; with cam_from_world: the same.
  std::optional<Pose> cam_from_part;
  /// Of (rotation vector, translation) of a small motion applied after cam_from_world: rad, m.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  bool in_model = false;  ///< the targets' model was made from it; else placed by resection, and adjusted at last
  std::string reason;     ///< why it is in the model, or was placed afterwards, or has no pose
  int part = -1;          ///< which connected part of the photographs it belongs to; 0: the largest; -1: none
  int points = 0;         ///< that count
  double rms_px = 0;
};

/// A target, or a board of targets, as it was solved.
struct CalibratedBody {
  std::string name;          ///< "matrix5x5 17", or the board's name
  int board = -1;            ///< index into TargetSet::boards
  int design = -1, id = -1;  ///< of a target that is a body of its own
  /// Which of a body's points is which: of point k, target features[k].design, id, feature.
  struct PointName {
    int design = 0, id = 0, feature = 0;
  };
  std::vector<PointName> features;
  AdjustedBody body;    ///< printed points, pose, bend
  bool placed = false;  ///< in the world: it belongs to part 0
  int part = -1;        ///< which connected part of the photographs it was solved with; 0: the largest; -1: none
  /// As printed to the frame of its part, whose place in the world nothing tells; of part 0: body.world_from_body.
  std::optional<Pose> part_from_body;
  std::vector<Eigen::Vector3d> points;             ///< in the world, m
  std::vector<Eigen::Matrix3d> point_covariances;  ///< m²
  int photos = 0;                                  ///< that count it
  double rms_px = 0;
};

/// One observation and what is left of it: for reports and tracks.
struct CalibrationResidual {
  int photo = 0, body = 0, point = 0;
  Eigen::Vector2d pixel{0, 0};  ///< measured
  Eigen::Vector2d error{0, 0};  ///< measured less predicted, px; not a number where that can't be told
  double sigmas = 0;            ///< sqrt(rᵀ Σ⁻¹ r) / sigma0
  double size_px = 0;           ///< circles: minor axis as seen, px; 0 for corners
  bool removed = false;
};

struct Calibration {
  std::vector<Camera> cameras;
  std::vector<Eigen::Matrix<double, kIntrinsics, kIntrinsics>> camera_covariances;
  std::vector<Pose> cam_from_rig;  ///< of CalibrateOptions::rig; identity otherwise
  std::vector<CalibratedPhoto> photos;
  std::vector<CalibratedBody> bodies;
  std::vector<CalibrationResidual> residuals;  ///< of all observations in photographs with a pose, removed ones too
  std::vector<Removed> removed;
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / observations that count)
  double share = 0;   ///< of the observations in placed photographs that count
  double sigma0 = 0;  ///< residuals over their covariances: about 1 where these are right
  Eigen::Vector2d print_scale{1, 1};
  int parts = 0;  ///< connected parts of the photographs
  /// Two halves of the photographs, each adjusted alone, aligned: RMS distance of the points, m; and of these distances
  /// over what the covariances expect, about 1. Negative: too few photographs.
  double cross_validation_m = -1, cross_validation_sigma = -1;
  /// Largest departure of each body's points from the printed pattern or, where targets are bodies of their own and lie
  /// on one sheet, of all points from a plane, m.
  double bend_m = 0;
  std::vector<std::string> warnings;  ///< weak geometry and what to do about it
  std::string verdict;                ///< one sentence: whether this calibration is good, and why
};

/// The bodies that a set and what was found make: its boards, or each target of its own. By board; by design and id.
LUMIHULL_API std::vector<CalibratedBody> bodies_of(const TargetSet& set, std::span<const PhotoTargets> photos);

/// From what was found in an unordered set of photographs to a pose for each of them and the targets' places: no start
/// is needed. Planar poses with both mirror solutions, a chain of photographs and bodies that grows from the pair that
/// is surest, adjustments in between, data snooping, resection of the rest (paper, section 3.1).
///
/// World: metres; origin in the middle of the targets and z up from them where they lie on one sheet or table, else the
/// frame of the body that is seen in most photographs. Errors: invalid_argument; degenerate (nothing can be placed:
/// says why); cancelled.
LUMIHULL_API Calibration calibrate_targets(const TargetSet& set, std::span<const PhotoTargets> photos,
                                           std::span<const CameraStart> cameras, const CalibrateOptions& options,
                                           Job& job);

}  // namespace lumihull::calib
