#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/target_set.h>

#include <cstddef>
#include <filesystem>
#include <vector>

namespace lumihull::calib {

struct CaptureDetectOptions {
  std::filesystem::path ink_key;  ///< a colour key of ink against everything else; empty: adaptive contrast
  double min_circle_px = 4.5;     ///< smallest minor axis that is looked for, >= 3
};

struct CaptureDetections {
  std::vector<PhotoTargets> photos;  ///< a shot each, in the capture's order; `shot` counts within its camera
  std::size_t kept = 0;              ///< photographs that were looked at before and have not changed
};

/// Finds the set's targets in all photographs of a capture. What was found in each is kept at once as
/// detections/NAME.json with a digest of photograph, set and options, so that a run that was stopped goes on where it
/// was. Photographs are done in parallel; those so large that one a thread would not fit into 2 GB one after the other,
/// each by all threads. Errors: those of TargetDetector and Capture::read_photo; io, cancelled.
LUMIHULL_API CaptureDetections detect_capture(const Capture& capture, const TargetSet& set,
                                              const CaptureDetectOptions& options, Job& job);

/// detections/NAME.json
LUMIHULL_API std::filesystem::path detections_path(const Capture& capture, const Shot& shot);

/// What is kept, without looking at photographs again: a shot whose file is missing has no targets. Errors: bad_input.
LUMIHULL_API CaptureDetections kept_detections(const Capture& capture, const TargetSet& set);

}  // namespace lumihull::calib
