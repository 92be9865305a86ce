#include <lumihull/base/error.h>
#include <lumihull/internal/json.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;
using internal::Json;

/// Mean of the values that are known.
class KnownMean {
 public:
  void add(double value) {
    if (std::isnan(value)) return;
    sum_ += value;
    ++count_;
  }
  double value() const { return count_ ? sum_ / count_ : std::numeric_limits<double>::quiet_NaN(); }

 private:
  double sum_ = 0;
  int count_ = 0;
};

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

/// Reference, rendering and four times their difference, side by side.
Image side_by_side(const Image& reference, const Image& picture) {
  const int w = reference.width(), h = reference.height();
  Image out(3 * w, h, 3);
  for (int y = 0; y < h; ++y) {
    const std::uint8_t *a = reference.row<std::uint8_t>(y), *b = picture.row<std::uint8_t>(y);
    std::uint8_t* o = out.row<std::uint8_t>(y);
    std::copy(a, a + 3 * w, o);
    std::copy(b, b + 3 * w, o + 3 * w);
    for (int i = 0; i < 3 * w; ++i) o[6 * w + i] = std::uint8_t(std::min(255, 4 * std::abs(int(a[i]) - int(b[i]))));
  }
  return out;
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json methods_json(const std::map<std::string, PictureQuality>& methods) {
  Json out = Json::object();
  for (const auto& [name, q] : methods)
    out[name] = {{"psnr", number(q.psnr)},
                 {"ssim", number(q.ssim)},
                 {"psnr_inside", number(q.psnr_inside)},
                 {"ssim_inside", number(q.ssim_inside)}};
  return out;
}

ViewEvaluation mean_of(const std::vector<ViewEvaluation>& views) {
  ViewEvaluation mean;
  KnownMean iou, keyed;
  std::map<std::string, std::array<KnownMean, 4>> methods;
  for (const ViewEvaluation& view : views) {
    iou.add(view.silhouette_iou);
    keyed.add(view.keyed_iou);
    for (const auto& [name, q] : view.methods) {
      auto& m = methods[name];
      m[0].add(q.psnr), m[1].add(q.ssim), m[2].add(q.psnr_inside), m[3].add(q.ssim_inside);
    }
  }
  mean.name = "mean";
  mean.silhouette_iou = iou.value();
  mean.keyed_iou = keyed.value();
  for (const auto& [name, m] : methods) mean.methods[name] = {m[0].value(), m[1].value(), m[2].value(), m[3].value()};
  return mean;
}

}  // namespace

std::optional<fs::path> reference_mask_file(const fs::path& folder, const std::string& name) {
  for (const char* extension : {".png", ".jpg", ".jpeg", ".tif", ".tiff"})
    if (fs::path file = folder / (name + extension); file_exists(file)) return file;
  return std::nullopt;
}

std::string Evaluation::to_json() const {
  Json out;
  out["photos_used"] = photos_used;
  out["photos_held_out"] = photos_held_out;
  out["silhouette_iou"] = number(mean.silhouette_iou);
  if (!std::isnan(mean.keyed_iou)) out["keyed_iou"] = mean.keyed_iou;
  out["triangles"] = triangles;
  out["model_bytes"] = model_bytes;
  if (light_field_bytes) out["light_field_bytes"] = light_field_bytes;
  out["methods"] = methods_json(mean.methods);
  out["stages"] = Json::object();
  for (const auto& [name, record] : stages)
    out["stages"][name] = {{"seconds", record.seconds}, {"peak_bytes", record.peak_bytes}};
  out["views"] = Json::array();
  for (const ViewEvaluation& view : views) {
    Json v = {{"name", view.name}, {"silhouette_iou", number(view.silhouette_iou)}};
    if (!std::isnan(view.keyed_iou)) v["keyed_iou"] = view.keyed_iou;
    v["methods"] = methods_json(view.methods);
    out["views"].push_back(std::move(v));
  }
  return out.dump(1);
}

Evaluation evaluate_capture(const Capture& capture, const EvaluateOptions& options, Job& job) {
  const std::vector<std::size_t> used = training_shots(capture), held_out = held_out_shots(capture);
  if (held_out.empty())
    throw Error(ErrorCode::degenerate, "no positioned photograph is held out: set hold_out to every Nth photograph",
                capture.folder().string());
  const fs::path model = options.model.empty() ? capture.folder() / "textured.glb" : options.model;
  const TexturedMesh textured = read_glb(model);
  const hull::RayScene scene(textured.mesh);
  const fs::path light_field_file =
      options.light_field.empty() ? capture.folder() / "light_field.glb" : options.light_field;
  std::optional<LightFieldRenderer> light_field;
  if (!options.light_field.empty() || file_exists(light_field_file))
    light_field.emplace(read_light_field(light_field_file));
  Lumigraph lumigraph(textured.mesh, scene, photos_of(capture, used), options.lumigraph);

  Evaluation evaluation;
  evaluation.photos_used = used.size();
  evaluation.photos_held_out = held_out.size();
  evaluation.triangles = textured.mesh.triangles.size();
  evaluation.model_bytes = fs::file_size(model);
  if (light_field) evaluation.light_field_bytes = fs::file_size(light_field_file);
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
    const auto judge = [&](const std::string& method, const Rendering& rendering) {
      const Image picture = composited(rendering.rgba, background);
      result.methods[method] = compare_pictures(picture, reference, photo.alpha);
      if (options.pictures) write_png(folder / (result.name + "." + method + ".png"), side_by_side(reference, picture));
    };
    const Rendering rendering = render_texture(textured, scene, references.views[i], options.render, job);
    result.silhouette_iou = silhouette_iou(coverage_of(rendering.rgba), photo.alpha);
    judge("mean_texture", rendering);
    if (light_field) judge("light_field", light_field->render(references.views[i], options.render, job));
    judge("lumigraph", lumigraph.render(references.views[i], options.render, job));
    evaluation.views.push_back(std::move(result));
  }
  evaluation.mean = mean_of(evaluation.views);
  return evaluation;
}

}  // namespace lumihull::slf
