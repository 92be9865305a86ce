#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>

#include <filesystem>
#include <optional>
#include <string>

namespace lumihull::calib {

/// Drives COLMAP over a folder of photographs with a folder for each camera in it.
struct ColmapRun {
  std::string program;
  std::filesystem::path photos, work;  ///< work: for database, models and log; exists
  std::size_t photo_count = 0;
  bool sequential = false;
  std::optional<Camera> known_camera;  ///< of all photographs; kept as it is
  std::string inputs;                  ///< digest of all that features and matches depend on

  /// work/inputs.txt holds `inputs` once database.db has the features of all photographs: then a run that was stopped
  /// goes on with matching. (Half of the features are not taken up: the program would make a second camera for the
  /// rest.)
  std::filesystem::path mark() const { return work / "inputs.txt"; }
  /// The folder of the model with most images. Errors: not_found (the program), degenerate (no model), unsupported (the
  /// lens of known_camera), internal program failures as io with its last words; cancelled.
  std::filesystem::path model(Job& job) const;
};

}  // namespace lumihull::calib
