#include <lumihull/base/error.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "judged_models.h"
#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;

Image reference_mask(const fs::path& folder, const std::string& name, const Camera& camera) {
  const std::optional<fs::path> file = reference_mask_file(folder, name);
  if (!file)
    throw Error(ErrorCode::not_found, "there is no reference mask named after the photograph",
                (folder / name).string());
  Image mask = read_image(*file, {.channels = 1});
  if (mask.width() != camera.width || mask.height() != camera.height)
    throw Error(ErrorCode::bad_input,
                "expected a mask of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                    " pixels, not " + std::to_string(mask.width()) + " x " + std::to_string(mask.height()),
                file->string());
  return mask.type() == PixelType::u8 ? std::move(mask) : converted(mask, PixelType::u8, 1);
}

Image coverage_of(const Image& rgba) {
  Image mask(rgba.width(), rgba.height(), 1);
  for (int y = 0; y < rgba.height(); ++y) {
    const std::uint8_t* s = rgba.row<std::uint8_t>(y);
    std::uint8_t* d = mask.row<std::uint8_t>(y);
    for (int x = 0; x < rgba.width(); ++x) d[x] = s[4 * x + 3];
  }
  return mask;
}

ViewEvaluation mean_of(const std::vector<ViewEvaluation>& views) {
  ViewEvaluation mean;
  KnownMean iou, keyed;
  MeanQualities methods;
  for (const ViewEvaluation& view : views) {
    iou.add(view.silhouette_iou);
    keyed.add(view.keyed_iou);
    methods.add(view.methods);
  }
  mean.name = "mean";
  mean.silhouette_iou = iou.value();
  mean.keyed_iou = keyed.value();
  mean.methods = methods.value();
  return mean;
}

}  // namespace

std::optional<fs::path> reference_mask_file(const fs::path& folder, const std::string& name) {
  for (const char* extension : {".png", ".jpg", ".jpeg", ".tif", ".tiff"})
    if (fs::path file = folder / (name + extension); file_exists(file)) return file;
  return std::nullopt;
}

Evaluation evaluate_capture(const Capture& capture, const EvaluateOptions& options, Job& job) {
  const std::vector<std::size_t> used = training_shots(capture), held_out = held_out_shots(capture);
  if (held_out.empty())
    throw Error(ErrorCode::degenerate, "no positioned photograph is held out: set hold_out to every Nth photograph",
                capture.folder().string());
  const fs::path model = options.model.empty() ? capture.folder() / "textured.glb" : options.model;
  const fs::path light_field_file =
      options.light_field.empty() ? capture.folder() / "light_field.glb" : options.light_field;
  const bool has_light_field = !options.light_field.empty() || file_exists(light_field_file);
  const JudgedModels models(capture, model, has_light_field ? light_field_file : fs::path(), options.lumigraph,
                            options.render, job);

  Evaluation evaluation;
  evaluation.photos_used = used.size();
  evaluation.photos_held_out = held_out.size();
  evaluation.triangles = models.triangles();
  evaluation.model_bytes = fs::file_size(model);
  if (has_light_field) evaluation.light_field_bytes = fs::file_size(light_field_file);
  evaluation.stages = capture.stages;
  const auto background = capture.background_rgb.value_or(std::array<std::uint8_t, 3>{0, 0, 0});
  const fs::path folder = capture.folder() / "evaluate";
  if (options.pictures) fs::create_directories(folder);

  const PhotoSet references = photos_of(capture, held_out);
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    job.check();
    Photo photo = references.read(i);
    ViewEvaluation result;
    result.name = references.names[i];
    if (!options.reference_masks.empty()) {
      Image mask = reference_mask(options.reference_masks, result.name, references.views[i].camera);
      if (capture.mask_state(capture.shots[held_out[i]]) != MaskSource::none)
        result.keyed_iou = silhouette_iou(photo.alpha, mask);
      photo.alpha = std::move(mask);
    }
    const Image reference = composited(photo.rgb, photo.alpha, background);
    for (const auto& [method, render] : models.methods()) {
      const Rendering rendering = render(references.views[i]);
      // The hull's silhouette: of the mesh as it was carved.
      if (method == "mean_texture") result.silhouette_iou = silhouette_iou(coverage_of(rendering.rgba), photo.alpha);
      const Image picture = composited(rendering.rgba, background);
      result.methods[method] = compare_pictures(picture, reference, photo.alpha);
      if (options.pictures) write_png(folder / (result.name + "." + method + ".png"), side_by_side(reference, picture));
    }
    evaluation.views.push_back(std::move(result));
  }
  evaluation.mean = mean_of(evaluation.views);
  if (!options.test_views.empty())
    evaluation.test_views = evaluate_test_views(options.test_views, models.methods(), background, {}, {}, job);
  return evaluation;
}

}  // namespace lumihull::slf
