#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/target_set.h>

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::calib {

/// What a capture's calibration found, as it is kept: the targets as solved, and how good it is.
struct LUMIHULL_API TargetModel {
  TargetSet set;
  std::vector<CameraStart> starts;  ///< what was known of the cameras before, in the capture's order
  struct Photo {
    std::string name;
    int camera = 0;  ///< index into `starts`
  };
  std::vector<Photo> photos;  ///< the shots that were there, in the capture's order
  /// Without `residuals`, which are not kept. Read from a file alone: without cameras, poses and covariances of poses.
  Calibration calibration;

  /// targets.json ("lumihull-target-model", version 1) of a capture; cameras, poses and their covariances are the
  /// capture's. Errors: not_found (the stage "calibrate" has not been run), io, bad_input (names the file, the JSON
  /// pointer and what was expected).
  static TargetModel of(const Capture& capture);
  /// Errors: not_found, io, bad_input.
  static TargetModel load(const std::filesystem::path& file);
  /// Errors: io, bad_input (a text that is not UTF-8, a number that is not finite).
  void save(const std::filesystem::path& file) const;
};

/// targets.json
LUMIHULL_API std::filesystem::path target_model_path(const Capture& capture);

/// Names of the enumerators.
LUMIHULL_API const char* name_of(Removed::Kind kind);
LUMIHULL_API const char* name_of(Removed::Why why);
LUMIHULL_API const char* name_of(BodyModel model);

/// The calibration's figures as one JSON object: photos, photos_placed, targets, rms_px, share, sigma0,
/// cross_validation, intrinsics with standard deviations, removed (kind, why, photo, target, off_px, text), parts,
/// print_scale, bend_m, warnings, verdict.
LUMIHULL_API std::string calibration_json(const TargetModel& model);

}  // namespace lumihull::calib
