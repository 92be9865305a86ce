#include <lumihull/base/files.h>
#include <lumihull/calib/target_model.h>
#include <lumihull/internal/json.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/truth.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "stage.h"

namespace lumihull::slf {

namespace {

std::filesystem::path reference_folder(const Capture& capture) {
  return effective<std::string>(capture, "evaluate", "reference_masks");
}

std::filesystem::path test_folder(const Capture& capture) {
  return effective<std::string>(capture, "evaluate", "test_views");
}

std::filesystem::path truth_folder(const Capture& capture) {
  return effective<std::string>(capture, "evaluate", "truth");
}

bool needed(const Capture& capture, std::string& why) {
  if (!held_out_shots(capture).empty() || !truth_folder(capture).empty()) return true;
  why = "no photograph is held out (--hold-out N), and no truth is named";
  return false;
}

void inputs(const Capture& capture, InputDigest& digest) {
  add_photos(capture, digest);
  add_cameras(capture, digest);
  add_masks(capture, digest);
  digest.add_file("model", textured_path(capture));
  digest.add_file("light field", light_field_path(capture));
  if (capture.background_rgb)
    digest.add("background", {reinterpret_cast<const char*>(capture.background_rgb->data()), 3});
  if (const std::filesystem::path folder = test_folder(capture); !folder.empty())
    for (const char* file : {"test_views.json", "mesh.ply"}) digest.add_file(file, folder / file);
  if (const std::filesystem::path folder = truth_folder(capture); !folder.empty()) {
    digest.add_file("hull", capture.hull_path());
    digest.add_file("target model", calib::target_model_path(capture));
    for (const char* file : {"cameras.json", "targets.json", "mesh.ply", "test_views.json"})
      digest.add_file(std::string("true ") + file, folder / file);
    for (const Shot& shot : capture.shots)
      digest.add_file("true mask " + shot.name, folder / "masks" / (shot.name + ".png"));
  }
  const std::filesystem::path references = reference_folder(capture);
  if (references.empty()) return;
  for (const std::size_t i : held_out_shots(capture)) {
    const std::string& name = capture.shots[i].name;
    const auto file = reference_mask_file(references, name);
    digest.add_file("reference " + name, file.value_or(references / name));
  }
}

bool present(const Capture& capture) {
  return file_exists(evaluation_path(capture)) &&
         (truth_folder(capture).empty() || file_exists(truth_page_path(capture)));
}

/// Compares with the truth, writes the page, and says what there is to say. Returns the comparison's JSON.
internal::Json compare(const Capture& capture, std::vector<std::string>& said, Job& job) {
  TruthOptions options;
  options.render.rays = int(effective<std::int64_t>(capture, "evaluate", "rays"));
  options.lumigraph.photographs = int(effective<std::int64_t>(capture, "evaluate", "photographs"));
  const TruthComparison comparison = compare_with_truth(capture, truth_folder(capture), options, job);
  const std::string page = truth_html(capture, comparison, job);
  std::filesystem::create_directories(truth_page_path(capture).parent_path());
  write_file(truth_page_path(capture), page);
  for (const std::string& line : comparison.summary()) said.push_back(line);
  said.push_back(truth_page_path(capture).string());
  return internal::parse_json(comparison.to_json(), "comparison");
}

std::vector<std::string> run(Capture& capture, Job& job) {
  EvaluateOptions options;
  options.reference_masks = reference_folder(capture);
  options.test_views = test_folder(capture);
  options.render.rays = int(effective<std::int64_t>(capture, "evaluate", "rays"));
  options.lumigraph.photographs = int(effective<std::int64_t>(capture, "evaluate", "photographs"));
  const bool truth = !truth_folder(capture).empty();
  Evaluation evaluation;
  // With a truth to go by, nothing need be held out.
  if (!truth || !held_out_shots(capture).empty()) evaluation = evaluate_capture(capture, options, job);

  std::vector<std::string> said;
  char line[200];
  if (evaluation.photos_held_out) {
    std::snprintf(line, sizeof line, "%zu photographs held out; silhouettes' IoU %.4f", evaluation.photos_held_out,
                  evaluation.mean.silhouette_iou);
    said.emplace_back(line);
  }
  if (!std::isnan(evaluation.mean.keyed_iou)) {
    std::snprintf(line, sizeof line, "keyed silhouettes' IoU %.4f", evaluation.mean.keyed_iou);
    said.emplace_back(line);
  }
  for (const auto& [method, quality] : evaluation.mean.methods) {
    std::snprintf(line, sizeof line, "%-13s PSNR %.2f dB, SSIM %.4f; inside %.2f dB, %.4f", method.c_str(),
                  quality.psnr, quality.ssim, quality.psnr_inside, quality.ssim_inside);
    said.emplace_back(line);
  }
  for (const auto& [method, quality] : evaluation.test_views.methods) {
    std::snprintf(line, sizeof line, "%-13s test views: PSNR %.2f dB, inside %.2f dB", method.c_str(), quality.psnr,
                  quality.psnr_inside);
    said.emplace_back(line);
  }
  for (const auto& [method, path] : evaluation.test_views.highlights) {
    std::snprintf(line, sizeof line, "%-13s highlights: %zu of %zu, along %.0f %% of their way, %.1f px off",
                  method.c_str(), path.found, path.places, 100 * path.share, path.rms_px);
    said.emplace_back(line);
  }
  internal::Json json = internal::parse_json(evaluation.to_json(), "evaluation");
  if (truth) json["truth"] = compare(capture, said, job);
  std::filesystem::create_directories(evaluation_path(capture).parent_path());
  write_file(evaluation_path(capture), json.dump(1) + "\n");
  return said;
}

}  // namespace

std::filesystem::path truth_page_path(const Capture& capture) { return capture.folder() / "evaluate" / "truth.html"; }

std::filesystem::path evaluation_path(const Capture& capture) {
  return capture.folder() / "evaluate" / "evaluation.json";
}

const StageDefinition& evaluate_stage() {
  static const EvaluateOptions defaults;
  static const StageDefinition stage{
      "evaluate",
      2,
      {
          {"reference_masks",
           "folder of masks to judge by, named like the photographs; empty: the capture's own",
           std::string(),
           0,
           0,
           {},
           true},
          {"test_views",
           "folder of test views as the virtual rig's truth/ has (cameras, pictures, highlights alone); empty: none",
           std::string(),
           0,
           0,
           {},
           true},
          {"truth",
           "folder of truth about the capture, as the virtual rig writes it: what everything is compared with; empty: "
           "none",
           std::string(),
           0,
           0,
           {},
           true},
          {"rays", "n x n rays a pixel", std::int64_t(defaults.render.rays), 1, 8},
          {"photographs", "blended at a point of the lumigraph", std::int64_t(defaults.lumigraph.photographs), 1, 16},
      },
      needed,
      inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
