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
  std::filesystem::path photos, work;   ///< work: for database, models and log; exists
  std::size_t photo_count = 0;
  bool sequential = false;
  std::optional<Camera> known_camera;  ///< of all photographs; kept as it is

  /// The folder of the model with most images. Errors: not_found (the program), degenerate (no model), unsupported (the
  /// lens of known_camera), internal program failures as io with its last words; cancelled.
  std::filesystem::path model(Job& job) const;
};

}  // namespace lumihull::calib
