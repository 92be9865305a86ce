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

/// A rig's photographs are brought together by counting: one that is missing would shift all that follow.
void check_rig(const Capture& capture) {
  std::vector<std::size_t> photos(capture.cameras.size(), 0);
  for (const Shot& shot : capture.shots) ++photos.at(std::size_t(shot.camera));
  if (photos.size() < 2)
    throw Error(ErrorCode::invalid_argument,
                "expected several cameras, found one: photographs of cameras that write the same EXIF count as one "
                "camera's",
                "rig");
  for (std::size_t c = 1; c < photos.size(); ++c)
    if (photos[c] != photos[0])
      throw Error(ErrorCode::invalid_argument,
                  "expected as many photographs of each camera, for the nth of all are taken for one moment; camera 0 "
                  "has " +
                      std::to_string(photos[0]) + ", camera " + std::to_string(c) + " has " + std::to_string(photos[c]),
                  "rig");
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
  CalibrateOptions solve = options.solve;
  solve.free_print_scale = solve.free_print_scale && options.bars.empty();  // its bars come after detection
  solve.validate();
  solve.free_print_scale = options.solve.free_print_scale;
  CalibrateCaptureReport report;
  TargetModel& model = report.model;
  model.set = coded_targets(options.targets);
  if (capture.shots.empty())
    throw Error(ErrorCode::bad_input, "the capture has no photographs", capture.folder().string());
  if (solve.rig) check_rig(capture);
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
  if (!options.bars.empty()) {
    const std::vector<CalibratedBody> bodies = bodies_of(model.set, seen.photos);
    solve.bars.clear();
    for (const TargetBar& bar : options.bars) solve.bars.push_back(bar_between(bar, model.set, bodies));
  }
  if (!solve.rig)
    for (std::size_t i = 0; i < seen.photos.size(); ++i) seen.photos[i].shot = int(i);
  model.calibration = calibrate_targets(model.set, seen.photos, model.starts, solve, job);

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
