#include <lumihull/base/error.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/feature_poses.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "stage.h"

namespace lumihull::slf {

namespace {

constexpr const char* kAuto = "auto";
const calib::CalibrateCaptureOptions kDefaults;
const calib::CalibrateOptions& kSolve = kDefaults.solve;

std::string free_text(const std::array<bool, calib::kIntrinsics>& free) {
  std::string text;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i]) text += (text.empty() ? "" : ",") + calib::intrinsic_names()[i];
  return text;
}

std::array<bool, calib::kIntrinsics> free_of(const std::string& text) {
  std::array<bool, calib::kIntrinsics> free{};
  const auto& names = calib::intrinsic_names();
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const auto found = std::find(names.begin(), names.end(), text.substr(at, end - at));
    if (found == names.end())
      throw Error(ErrorCode::invalid_argument,
                  "expected names of f, s, skew, u0, v0, k1, k2, k3, p1, p2, by commas; found \"" +
                      text.substr(at, end - at) + "\"",
                  "free");
    free[std::size_t(found - names.begin())] = true;
    at = end + 1;
  }
  return free;
}

bool is_file(const std::string& intrinsics) { return intrinsics != "refine" && intrinsics != "fixed"; }

calib::CalibrateCaptureOptions options_of(const Capture& capture) {
  calib::CalibrateCaptureOptions o;
  o.targets = effective<std::string>(capture, "calibrate", "targets");
  const auto intrinsics = effective<std::string>(capture, "calibrate", "intrinsics");
  if (is_file(intrinsics)) o.intrinsics = intrinsics;
  o.detect.ink_key = effective<std::string>(capture, "calibrate", "ink_key");
  o.detect.min_circle_px = effective<double>(capture, "calibrate", "min_circle_px");
  o.solve.refine_intrinsics = intrinsics == "refine";
  const auto free = effective<std::string>(capture, "calibrate", "free");
  o.solve.more_if_needed = free == kAuto;
  if (free != kAuto) o.solve.free = free_of(free);
  const auto model = effective<std::string>(capture, "calibrate", "model");
  o.solve.model = model == "rigid"     ? calib::BodyModel::rigid
                  : model == "bending" ? calib::BodyModel::bending
                                       : calib::BodyModel::free;
  o.solve.model_photos = int(effective<std::int64_t>(capture, "calibrate", "model_photos"));
  o.solve.outlier_sigma = effective<double>(capture, "calibrate", "outlier_sigma");
  o.solve.rig = effective<bool>(capture, "calibrate", "rig");
  o.bars = calib::bars_from_text(effective<std::string>(capture, "calibrate", "bar"));
  o.solve.free_print_scale = effective<bool>(capture, "calibrate", "free_print_scale");
  return o;
}

bool by_features(const Capture& capture) { return effective<bool>(capture, "calibrate", "features"); }

bool needed(const Capture& capture, std::string& why) {
  const bool ours = capture.stages.contains("calibrate");
  const auto positioned = std::count_if(capture.shots.begin(), capture.shots.end(),
                                        [](const Shot& shot) { return shot.cam_from_world.has_value(); });
  if (!ours && positioned > 0) {
    why = "poses were imported";
    return false;
  }
  if (!effective<std::string>(capture, "calibrate", "targets").empty() || by_features(capture)) return true;
  why = "no targets are named (--targets aruco:6x6_250:35mm, for example)";
  return false;
}

void inputs(const Capture& capture, InputDigest& digest) {
  add_photos(capture, digest);
  add_intrinsics(capture, digest);
  for (const char* file : {"targets", "ink_key", "intrinsics"})
    if (const auto path = effective<std::string>(capture, "calibrate", file);
        !path.empty() && (std::string_view(file) != "intrinsics" || is_file(path)))
      digest.add_file(file, path);
}

bool present(const Capture& capture) {
  const bool posed = std::any_of(capture.shots.begin(), capture.shots.end(),
                                 [](const Shot& shot) { return shot.cam_from_world.has_value(); });
  return posed && (by_features(capture) || (file_exists(calib::target_model_path(capture)) &&
                                            file_exists(capture.folder() / "calibration.html")));
}

/// A long list of lines shortened to its beginning and end.
void say_some(std::vector<std::string>& said, const std::vector<std::string>& lines) {
  constexpr std::size_t kSaid = 12;
  const std::size_t n = lines.size(), left_out = n > kSaid ? n - kSaid : 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (left_out > 0 && i == kSaid / 2) said.push_back("… " + std::to_string(left_out) + " more: see calibration.html");
    if (i < kSaid / 2 || i >= kSaid / 2 + left_out) said.push_back(lines[i]);
  }
}

std::vector<std::string> run_targets(Capture& capture, Job& job) {
  const calib::CalibrateCaptureReport report = calib::calibrate_capture(capture, options_of(capture), job);
  const calib::Calibration& c = report.model.calibration;
  std::vector<std::string> said;
  said.push_back(std::to_string(report.found) + " targets found in " + std::to_string(capture.shots.size()) +
                 " photographs" +
                 (report.kept > 0 ? ", " + std::to_string(report.kept) + " of which were looked at before" : ""));
  const auto placed = std::count_if(c.photos.begin(), c.photos.end(),
                                    [](const calib::CalibratedPhoto& p) { return p.cam_from_world.has_value(); });
  const auto bodies =
      std::count_if(c.bodies.begin(), c.bodies.end(), [](const calib::CalibratedBody& b) { return b.placed; });
  char line[240];
  std::snprintf(line, sizeof line,
                "%td of %zu photographs and %td of %zu targets placed, RMS %.4f px, %.2f times what the points' "
                "covariances say",
                placed, c.photos.size(), bodies, c.bodies.size(), c.rms_px, c.sigma0);
  said.emplace_back(line);
  if (c.cross_validation_m >= 0) {
    std::snprintf(line, sizeof line, "two halves of the photographs differ by %.3g mm, %.2f times what is expected",
                  1e3 * c.cross_validation_m, c.cross_validation_sigma);
    said.emplace_back(line);
  }
  std::vector<std::string> removed;
  std::size_t points = 0;
  for (const calib::Removed& r : c.removed) {
    if (r.kind == calib::Removed::Kind::observation)
      ++points;
    else
      removed.push_back("removed: " + r.text);
  }
  if (points > 0) said.push_back("removed: " + std::to_string(points) + " single points that are outliers");
  say_some(said, removed);
  for (const std::string& warning : c.warnings) said.push_back("warning: " + warning);
  said.push_back(c.verdict);
  return said;
}

std::vector<std::string> run_features(Capture& capture, Job& job) {
  calib::FeatureOptions o;
  o.sequential = effective<bool>(capture, "calibrate", "sequential");
  o.scale_distance = calib::ScaleDistance::from_text(effective<std::string>(capture, "calibrate", "scale_distance"));
  if (const auto targets = effective<std::string>(capture, "calibrate", "targets"); !targets.empty())
    o.targets = calib::TargetSet::from_text(targets);
  return calib::poses_from_features(capture, o, job).said;
}

std::vector<std::string> run(Capture& capture, Job& job) {
  return by_features(capture) ? run_features(capture, job) : run_targets(capture, job);
}

}  // namespace

const StageDefinition& calibrate_stage() {
  static const StageDefinition stage{
      "calibrate",
      1,
      {
          {"targets",
           "what was printed: words as matrix5x5:18mm, apriltag:36h11:50mm, aruco:6x6_250:35mm, joined by commas, or "
           "the file that describes it",
           std::string(),
           0,
           0,
           {},
           true,
           true},
          {"intrinsics",
           "refine (from what is known, EXIF, or nothing), fixed (keep the capture's cameras), or a file that "
           "`lumihull intrinsics` wrote, kept as it is",
           std::string("refine"),
           0,
           0,
           {"refine", "fixed"},
           true},
          {"free",
           "parameters that are refined, of f, s, skew, u0, v0, k1, k2, k3, p1, p2; auto: " + free_text(kSolve.free) +
               ", and s and k3 where the residuals ask for them",
           std::string(kAuto)},
          {"model",
           "what paper does: rigid (as printed), bending (curved sheets), free (each point on its own)",
           std::string(calib::name_of(kSolve.model)),
           0,
           0,
           {"rigid", "bending", "free"}},
          {"model_photos",
           "photographs that the targets' model is made from; the others are placed by it and join the last "
           "adjustment; 0: all",
           std::int64_t(kSolve.model_photos), 0, 1e6},
          {"outlier_sigma", "points farther off than so many standard deviations are removed", kSolve.outlier_sigma, 2,
           100},
          {"rig",
           "cameras are fixed to each other: the nth photograph of each camera, in the order of import, was taken at "
           "one "
           "moment, so that each must have as many",
           kSolve.rig},
          {"bar",
           "a distance that was measured between two points of targets: ID.POINT,ID.POINT,LENGTH[,SIGMA], in metres or "
           "as "
           "500mm; several times, or by semicolons. POINT: circles row by row from 0, corners clockwise",
           std::string(),
           0,
           0,
           {},
           false,
           false,
           true},
          {"free_print_scale", "the print's scale along its x and y is estimated too; needs bars",
           kSolve.free_print_scale},
          {"ink_key", "a trained key of the targets' ink; empty: by contrast", std::string(), 0, 0, {}, true},
          {"min_circle_px", "smallest minor axis of a target's circles that is looked for, px",
           kDefaults.detect.min_circle_px, 3, 1000},
          {"features", "without targets: poses by COLMAP's features (its program `colmap` must be installed)", false},
          {"sequential", "features: match each photograph with those that follow it only, as in a film", false},
          {"scale_distance",
           "features: NAME_A NAME_B METRES, the distance of two photographs' cameras, gives the scale", std::string()},
      },
      needed,
      inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
