#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/detect_capture.h>
#include <lumihull/calib/target_bar.h>
#include <lumihull/calib/target_model.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull::calib {

struct CalibrateCaptureOptions {
  std::string targets;  ///< a word or a file, as TargetSet::from_text takes it
  /// A file of a calibrated lens ("lumihull-intrinsics"), kept as it is for all cameras of its size; empty: see
  /// camera_starts.
  std::filesystem::path intrinsics;
  CaptureDetectOptions detect;
  std::vector<TargetBar> bars;  ///< in place of solve.bars, which names bodies that are known only after detection
  /// rig: the nth photograph of each camera, in the capture's order, is of the nth moment.
  CalibrateOptions solve;
};

/// What is known of a capture's cameras before they are calibrated: the intrinsics of the file where their size is the
/// camera's; else of a camera that was calibrated here before what was known then; else cameras.json's, unless that
/// is only what camera_of_header says of the camera's first photograph: then EXIF's focal length, or nothing.
/// Errors: bad_input (no camera has the size of those in the file), and those of load_intrinsics and read_image_info.
LUMIHULL_API std::vector<CameraStart> camera_starts(const Capture& capture, const std::filesystem::path& intrinsics);

struct CalibrateCaptureReport {
  TargetModel model;      ///< cameras, poses and residuals included
  std::size_t found = 0;  ///< targets, in all photographs
  std::size_t kept = 0;   ///< photographs whose targets were known from before
};

/// The stage "calibrate": targets are found in all photographs (detect_capture), and from them come a pose for each
/// photograph, the cameras' intrinsics and the targets' places (calibrate_targets). Stores cameras, poses and how well
/// they are known in the capture (unit: metres) and saves it, then writes targets.json and calibration.html. Poses that
/// were there are replaced; a photograph that can't be placed loses its own. The files change only after everything was
/// computed. Errors: invalid_argument (targets, options, bars; rig: cameras that have not
/// as many photographs), degenerate (no target found, nothing can be placed), io,
/// cancelled, and those of the functions named.
LUMIHULL_API CalibrateCaptureReport calibrate_capture(Capture& capture, const CalibrateCaptureOptions& options,
                                                      Job& job);

/// Puts a calibration's result into the capture's value; nothing is written. model: of all of the capture's shots and
/// cameras, in its order. Errors: invalid_argument (of others).
LUMIHULL_API void store_calibration(Capture& capture, const TargetModel& model);

}  // namespace lumihull::calib
