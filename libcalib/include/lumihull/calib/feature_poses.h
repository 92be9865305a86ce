#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/target_set.h>

#include <optional>
#include <string>
#include <vector>

namespace lumihull::calib {

/// What was measured between the cameras of two photographs.
struct LUMIHULL_API ScaleDistance {
  std::string photo_a, photo_b;  ///< names of shots
  double metres = 0;             ///< between the cameras' centres

  /// "NAME_A,NAME_B,METRES", or blanks between where no name has one; nullopt of an empty text.
  /// Errors: invalid_argument.
  static std::optional<ScaleDistance> from_text(const std::string& text);
};

struct FeatureOptions {
  std::string program = "colmap";  ///< looked for as a shell does
  bool sequential = false;         ///< match each photograph with its followers only, as in a film; else each with each
  std::optional<ScaleDistance> scale_distance;
  std::optional<TargetSet> targets;  ///< where photographs show some, their printed size gives the scale
};

struct FeatureReport {
  std::size_t placed = 0;         ///< photographs with a pose
  std::optional<double> scale;    ///< metres / the program's unit; nullopt: unit unknown
  std::vector<std::string> said;  ///< a line each
};

/// Poses and cameras of a capture without targets: drives the program COLMAP (feature_extractor, a matcher, mapper; on
/// the CPU) as a child process and takes over its largest model. A single camera whose intrinsics are known
/// (camera_starts) keeps them. Stores poses and cameras in the capture and saves it; a targets.json of before is
/// removed, for it would be of another world. A run that failed or was stopped leaves the program's words in
/// features/colmap.log, and once all features are found also its database, which a run of the same photographs goes on
/// with; a run that ends removes both. Errors: not_found (the program), degenerate (fewer than three photographs, or
/// nothing that they agree on), invalid_argument (scale_distance of photographs that are not there), unsupported (a
/// lens), io, cancelled.
LUMIHULL_API FeatureReport poses_from_features(Capture& capture, const FeatureOptions& options, Job& job);

}  // namespace lumihull::calib
