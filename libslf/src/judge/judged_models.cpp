#include "judged_models.h"

#include <lumihull/base/error.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/photos.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

#include "stages/stage.h"

namespace lumihull::slf {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

JudgedModels::JudgedModels(const Capture& capture, const fs::path& textured, const fs::path& light_field,
                           const LumigraphOptions& lumigraph, const RenderOptions& render, Job& job)
    : textured_(read_glb(textured)),
      scene_(textured_.mesh),
      lumigraph_(textured_.mesh, scene_, photos_of(capture, training_shots(capture)), lumigraph) {
  if (!light_field.empty()) light_field_.emplace(read_light_field(light_field));
  methods_["mean_texture"] = [this, render, &job](const View& v) {
    return render_texture(textured_, scene_, v, render, job);
  };
  methods_["lumigraph"] = [this, render, &job](const View& v) { return lumigraph_.render(v, render, job); };
  if (light_field_)
    methods_["light_field"] = [this, render, &job](const View& v) { return light_field_->render(v, render, job); };
}

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

TestViewEvaluation evaluate_test_views(const fs::path& folder, const Methods& methods,
                                       const std::array<std::uint8_t, 3>& background,
                                       const std::function<Pose(const Pose&)>& placed,
                                       const fs::path& folder_of_pictures, Job& job) {
  const std::vector<PathView> views = read_camera_path(folder / "test_views.json");
  const fs::path without = folder / "test_views" / "without_highlights", alone = folder / "test_views" / "highlights";
  std::optional<HighlightJudge> judge;
  if (!views.empty() && file_exists(folder / "mesh.ply") && file_exists(without / (views[0].name + ".png")))
    judge.emplace(hull::read_mesh(folder / "mesh.ply"));
  if (!folder_of_pictures.empty()) fs::create_directories(folder_of_pictures);
  TestViewEvaluation out;
  out.views = views.size();
  MeanQualities means;
  for (const PathView& v : views) {
    job.check();
    const Image photo = test_picture(folder / "test_views" / (v.name + ".png"), v.view.camera, 3);
    const Image mask = test_picture(folder / "test_views" / "masks" / (v.name + ".png"), v.view.camera, 1);
    const Image reference = composited(photo, mask, background);
    if (judge) {
      const auto part = [&](const fs::path& of, const std::array<std::uint8_t, 3>& around) {
        return composited(test_picture(of / (v.name + ".png"), v.view.camera, 3), mask, around);
      };
      judge->add_view(v.view, part(without, background), part(alone, {0, 0, 0}), reference);
    }
    View view = v.view;
    if (placed) view.cam_from_world = placed(view.cam_from_world);
    std::map<std::string, PictureQuality> qualities;
    for (const auto& [name, render] : methods) {
      const Image picture = composited(render(view).rgba, background);
      qualities[name] = compare_pictures(picture, reference, mask);
      if (!folder_of_pictures.empty())
        write_png(folder_of_pictures / (v.name + "." + name + ".png"), side_by_side(reference, picture));
      if (judge) judge->add_picture(name, picture);
    }
    means.add(qualities);
  }
  out.methods = means.value();
  if (judge) out.highlights = judge->paths();
  return out;
}

}  // namespace lumihull::slf
