// A capture beside the truth about it: which parts can be compared, and in which order.
#include <lumihull/base/error.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/hull/mesh.h>

#include <functional>

#include "judge/judged_models.h"
#include "parts.h"
#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;
using truth::Pair;

std::string without(const std::string& what, const std::string& why) { return what + ": " + why; }

/// Poses, lenses and targets; what everything else is aligned by. nullopt where the worlds can't be brought together.
std::optional<truth::Similarity> compare_cameras(const Capture& capture, const fs::path& folder,
                                                 std::vector<Pair>& pairs, TruthComparison& out) {
  const bool rigid = capture.unit == Unit::metres;
  const auto cameras = truth::read_true_cameras(folder);
  const auto true_targets = truth::read_true_targets(folder);
  if (!cameras) {
    out.left_out.push_back(without("poses, lenses, targets, surface, new views", "the truth has no cameras.json"));
    return std::nullopt;
  }
  PoseTruth poses;
  pairs = truth::paired_shots(capture, *cameras, poses);
  if (pairs.empty() && poses.not_placed.empty())
    throw Error(ErrorCode::bad_input, "no view is named like one of the capture's photographs",
                (folder / "cameras.json").string());
  std::vector<Pose> found, real;
  for (const Pair& p : pairs) {
    found.push_back(*capture.shots[p.shot].cam_from_world);
    real.push_back(p.truth.cam_from_world);
  }
  const auto alignment = truth::align_cameras(found, real, rigid);
  if (!alignment) {
    out.left_out.push_back(without("poses, lenses, targets, surface, new views",
                                   pairs.empty() ? "no photograph of the truth has a pose"
                                                 : "one place of the camera does not tell the capture's scale"));
    return std::nullopt;
  }
  std::optional<truth::Similarity> by_targets;
  const bool solved = file_exists(calib::target_model_path(capture));
  if (true_targets && solved) {
    truth::TargetPairs targets = truth::paired_targets(capture, *true_targets);
    by_targets = truth::align_targets(targets, rigid);
    out.targets = truth::compare_targets(std::move(targets), alignment->truth_from_capture);
  } else {
    out.left_out.push_back(
        without("targets", true_targets ? "the capture has none solved" : "the truth has no targets.json"));
  }
  out.lenses = truth::compare_lenses(capture, pairs);
  truth::compare_poses(capture, pairs, *alignment, by_targets, poses);
  out.poses = std::move(poses);
  return alignment->truth_from_capture;
}

void compare_views(const Capture& capture, const fs::path& folder, const truth::Similarity& truth_from_capture,
                   const TruthOptions& options, TruthComparison& out, Job& job) {
  if (!file_exists(folder / "test_views.json")) {
    out.left_out.push_back(without("new views", "the truth has no test_views.json"));
    return;
  }
  const fs::path light_field = light_field_path(capture);
  const bool has_light_field = file_exists(light_field);
  if (!file_exists(textured_path(capture))) {
    out.left_out.push_back(without("new views", "the capture has no textured.glb"));
    return;
  }
  if (!has_light_field) out.left_out.push_back(without("new views of the light field", "there is no light_field.glb"));
  const JudgedModels models(capture, textured_path(capture), has_light_field ? light_field : fs::path(),
                            options.lumigraph, options.render, job);
  const auto background = capture.background_rgb.value_or(std::array<std::uint8_t, 3>{0, 0, 0});
  out.views = evaluate_test_views(
      folder, models.methods(), background,
      [&](const Pose& cam_from_truth) { return truth_from_capture.in_capture(cam_from_truth); },
      options.pictures ? capture.folder() / "evaluate" / "test_views" : fs::path(), job);
  std::error_code ignored;
  if (out.views->highlights.empty())
    out.left_out.push_back(
        without("highlights", fs::is_directory(folder / "test_views" / "highlights", ignored)
                                  ? "none that can be told from the paint is seen in two test views in a row"
                                  : "the truth has no test_views/highlights/"));
}

}  // namespace

void TruthOptions::validate() const {
  const auto check = [](bool good, const char* field, const char* expected) {
    if (!good) throw Error(ErrorCode::invalid_argument, std::string("expected ") + expected, field);
  };
  check(surface_samples >= 1000 && surface_samples <= 10'000'000, "surface_samples", "1000 to 10,000,000");
  check(outside_mm >= 0 && outside_mm < 1e9, "outside_mm", "a length of at least 0");
  check(silhouette_views >= 1, "silhouette_views", "at least 1");
  check(silhouette_side_px >= 16, "silhouette_side_px", "at least 16");
}

TruthComparison compare_with_truth(const Capture& capture, const fs::path& folder, const TruthOptions& options,
                                   Job& job) {
  options.validate();
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw Error(ErrorCode::not_found, "there is no such folder of truth", folder.string());
  if (!file_exists(folder / "cameras.json") && !fs::is_directory(folder / "masks", ignored))
    throw Error(ErrorCode::not_found, "expected cameras.json or masks/ in a folder of truth", folder.string());
  job.check();
  TruthComparison out;
  out.truth = folder.string();
  std::vector<Pair> pairs;
  const auto truth_from_capture = compare_cameras(capture, folder, pairs, out);

  if (!fs::is_directory(folder / "masks", ignored))
    out.left_out.push_back(without("masks", "the truth has none"));
  else if (!(out.masks = truth::compare_masks(capture, folder / "masks", job)))
    out.left_out.push_back(without("masks", "no photograph has both"));
  if (!truth_from_capture) return out;

  const bool has_mesh = file_exists(folder / "mesh.ply"), has_hull = file_exists(capture.hull_path());
  if (has_mesh && has_hull)
    out.surface =
        truth::compare_surface(capture, hull::read_mesh(capture.hull_path()), hull::read_mesh(folder / "mesh.ply"),
                               *truth_from_capture, pairs, options, job);
  else
    out.left_out.push_back(without("surface", has_mesh ? "the capture has no hull.ply" : "the truth has no mesh.ply"));
  compare_views(capture, folder, *truth_from_capture, options, out, job);
  return out;
}

}  // namespace lumihull::slf
