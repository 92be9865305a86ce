#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/evaluate.h>

#include <filesystem>

namespace lumihull::slf {

struct ReportOptions {
  std::filesystem::path file;  ///< empty: report.html in the capture
  int turntable_frames =
      8;  ///< pictures of a turn around the light field, and around the textured model, 0 … 36; 0: neither is shown
  const Evaluation* evaluation = nullptr;  ///< its table and comparison pictures, where there is one
};

/// Writes a page without external resources: the light field from all sides, and one place of it as the eye moves; the
/// evaluation with its comparison pictures; the textured model, the hull, photographs and masks; times and memory of
/// the stages. What the capture does not have yet is left out. Atomic. Errors:
/// bad_input or not_found where a file that the capture names cannot be read, io.
LUMIHULL_API void write_report(const Capture& capture, const ReportOptions& options, Job& job);

}  // namespace lumihull::slf
