// From a capture's folder to its calibration, and back into the folder.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/calibrate_capture.h>

#include <algorithm>
#include <utility>

#include "calibration_report.h"

namespace lumihull::calib {
namespace {

/// The set that is named, checked for what calibration can use of it.
TargetSet coded_targets(const std::string& text) {
  if (text.empty())
    throw Error(ErrorCode::invalid_argument,
                "say what was printed: a word as aruco:6x6_250:35mm or matrix5x5:18mm, or the file that was written "
                "with the sheets",
                "targets");
  TargetSet set = TargetSet::from_text(text);
  if (set.designs.empty())
    throw Error(ErrorCode::invalid_argument,
                "expected coded targets: points without ids, as a chessboard's, can't tell which photographs show "
                "the same",
                "targets");
  return set;
}

}  // namespace

void store_calibration(Capture& capture, const TargetModel& model) {
  const Calibration& c = model.calibration;
  if (c.photos.size() != capture.shots.size() || c.cameras.size() != capture.cameras.size() ||
      c.camera_covariances.size() != c.cameras.size())
    throw Error(ErrorCode::invalid_argument, "the calibration is not of this capture's photographs and cameras");
  capture.unit = Unit::metres;
  capture.cameras = c.cameras;
  capture.camera_covariances.clear();
  for (std::size_t i = 0; i < c.cameras.size(); ++i)
    if (!c.camera_covariances[i].isZero(0)) capture.camera_covariances[int(i)] = c.camera_covariances[i];
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    const CalibratedPhoto& photo = c.photos[i];
    Shot& shot = capture.shots[i];
    shot.cam_from_world = photo.cam_from_world;
    shot.pose_quality.reset();
    if (photo.cam_from_world) shot.pose_quality = PoseQuality{photo.covariance, photo.points, photo.rms_px};
  }
  // What import said of focal lengths is history for cameras that were refined.
  std::erase_if(capture.notes, [&](const std::string& note) {
    for (const auto& [camera, covariance] : capture.camera_covariances)
      if (note.starts_with("camera " + std::to_string(camera) + ": f ")) return true;
    return false;
  });
}

CalibrateCaptureReport calibrate_capture(Capture& capture, const CalibrateCaptureOptions& options, Job& job) {
  options.solve.validate();
  CalibrateCaptureReport report;
  TargetModel& model = report.model;
  model.set = coded_targets(options.targets);
  if (capture.shots.empty())
    throw Error(ErrorCode::bad_input, "the capture has no photographs", capture.folder().string());
  model.starts = camera_starts(capture, options.intrinsics);
  for (const Shot& shot : capture.shots) model.photos.push_back({shot.name, shot.camera});
  capture.refresh_stamps(job);

  CaptureDetections seen = detect_capture(capture, model.set, options.detect, job);
  report.kept = seen.kept;
  for (const PhotoTargets& photo : seen.photos) report.found += photo.targets.size();
  if (report.found == 0)
    throw Error(ErrorCode::degenerate,
                "none of the " + std::to_string(capture.shots.size()) + " photographs shows a target of \"" +
                    options.targets +
                    "\": is that what was printed, in focus and not too small? `lumihull detect PHOTO --targets … "
                    "--draw FOLDER` shows what is seen",
                capture.folder().string());
  if (!options.solve.rig)
    for (std::size_t i = 0; i < seen.photos.size(); ++i) seen.photos[i].shot = int(i);
  model.calibration = calibrate_targets(model.set, seen.photos, model.starts, options.solve, job);

  const std::string page = calibration_report_html(capture, model, job);
  Capture stored = capture;
  store_calibration(stored, model);
  stored.save();
  capture = std::move(stored);
  model.save(target_model_path(capture));
  write_file(capture.folder() / "calibration.html", page);
  return report;
}

}  // namespace lumihull::calib
