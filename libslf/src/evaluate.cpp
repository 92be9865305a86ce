#include <lumihull/base/error.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>

#include "stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;

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

class MeanQualities {
 public:
  void add(const std::map<std::string, PictureQuality>& methods) {
    for (const auto& [name, q] : methods) {
      auto& m = sums_[name];
      m[0].add(q.psnr), m[1].add(q.ssim), m[2].add(q.psnr_inside), m[3].add(q.ssim_inside);
    }
  }
  std::map<std::string, PictureQuality> value() const {
    std::map<std::string, PictureQuality> out;
    for (const auto& [name, m] : sums_) out[name] = {m[0].value(), m[1].value(), m[2].value(), m[3].value()};
    return out;
  }

 private:
  std::map<std::string, std::array<KnownMean, 4>> sums_;
};

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

/// What is judged, by its name in the evaluation.
using Methods = std::map<std::string, std::function<Rendering(const View&)>>;

/// A picture of the test views' folder that fits the camera.
Image test_picture(const fs::path& file, const Camera& camera, int channels) {
  Image image = read_image(file, {.channels = channels});
  if (image.type() != PixelType::u8) image = converted(image, PixelType::u8, channels);
  if (image.width() != camera.width || image.height() != camera.height)
    throw Error(ErrorCode::bad_input,
                "expected a picture of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                    " pixels, not " + std::to_string(image.width()) + " x " + std::to_string(image.height()),
                file.string());
  return image;
}

TestViewEvaluation evaluate_test_views(const fs::path& folder, const Methods& methods,
                                       const std::array<std::uint8_t, 3>& background, Job& job) {
  const std::vector<PathView> views = read_camera_path(folder / "test_views.json");
  const fs::path truth_file = folder / "test_highlights.json";
  std::vector<ViewHighlights> truth;
  if (file_exists(truth_file)) truth = read_highlights(truth_file);
  if (!truth.empty() && truth.size() != views.size())
    throw Error(ErrorCode::bad_input, "expected the highlights of " + std::to_string(views.size()) + " views",
                truth_file.string());
  TestViewEvaluation out;
  out.views = views.size();
  MeanQualities means;
  std::map<std::string, std::vector<Image>> pictures;
  for (const PathView& v : views) {
    job.check();
    const Image photo = test_picture(folder / "test_views" / (v.name + ".png"), v.view.camera, 3);
    const Image mask = test_picture(folder / "test_views" / "masks" / (v.name + ".png"), v.view.camera, 1);
    const Image reference = composited(photo, mask, background);
    std::map<std::string, PictureQuality> qualities;
    for (const auto& [name, render] : methods) {
      Image picture = composited(render(v.view).rgba, background);
      qualities[name] = compare_pictures(picture, reference, mask);
      if (!truth.empty()) pictures[name].push_back(std::move(picture));
    }
    if (!truth.empty()) pictures["photograph"].push_back(reference);
    means.add(qualities);
  }
  out.methods = means.value();
  for (const auto& [name, of_method] : pictures)
    out.highlights[name] = follow_highlight(of_method, pictures["photograph"], pictures["mean_texture"], truth);
  return out;
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

  Methods methods;
  methods["mean_texture"] = [&](const View& v) { return render_texture(textured, scene, v, options.render, job); };
  methods["lumigraph"] = [&](const View& v) { return lumigraph.render(v, options.render, job); };
  if (light_field) methods["light_field"] = [&](const View& v) { return light_field->render(v, options.render, job); };

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
    for (const auto& [method, render] : methods) {
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
    evaluation.test_views = evaluate_test_views(options.test_views, methods, background, job);
  return evaluation;
}

}  // namespace lumihull::slf
