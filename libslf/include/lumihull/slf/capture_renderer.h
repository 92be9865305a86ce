#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/light_field.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/results.h>

#include <optional>
#include <string>
#include <vector>

namespace lumihull::slf {

/// Renders views of a capture by "light_field" (the factored model), "lumigraph" (blends photographs), "mean_texture"
/// (the textured model) or "shaded" (the bare hull). `scene_` and `lumigraph_` refer to `model_`: the object stays
/// where it was made. One thread at a time.
class CaptureRenderer {
 public:
  /// Errors: invalid_argument (method), not_found (what the method needs has not been made).
  CaptureRenderer(const Capture& capture, const std::string& method) {
    if (method != "light_field" && method != "lumigraph" && method != "mean_texture" && method != "shaded")
      throw Error(ErrorCode::invalid_argument,
                  "expected \"light_field\", \"lumigraph\", \"mean_texture\" or \"shaded\", found \"" + method + "\"",
                  "method");
    if (method == "light_field")
      light_field_.emplace(read_light_field(capture));
    else if (method == "mean_texture")
      model_ = read_textured(capture);
    else
      model_.mesh = read_hull(capture);
    if (!light_field_) scene_.emplace(model_.mesh);
    const auto shots = training_shots(capture);
    for (const std::size_t i : shots) photographs_.push_back(capture.view(i));
    if (method == "lumigraph") lumigraph_.emplace(model_.mesh, *scene_, photos_of(capture, shots));
  }
  CaptureRenderer(const CaptureRenderer&) = delete;
  CaptureRenderer& operator=(const CaptureRenderer&) = delete;

  Rendering render(const View& view, const RenderOptions& options, Job& job) {
    if (light_field_) return light_field_->render(view, options, job);
    if (lumigraph_) return lumigraph_->render(view, options, job);
    if (!model_.texture.empty()) return render_texture(model_, *scene_, view, options, job);
    return render_shaded(model_.mesh, *scene_, view, options, job);
  }

  /// A full turn around the object, whose up is the photographs'.
  std::vector<PathView> turntable(const TurntableOptions& options) const {
    return slf::turntable(light_field_ ? light_field_->mesh() : model_.mesh, photographs_, options);
  }

 private:
  TexturedMesh model_;  ///< without texture for the methods that need none
  std::optional<hull::RayScene> scene_;
  std::optional<Lumigraph> lumigraph_;
  std::optional<LightFieldRenderer> light_field_;
  std::vector<View> photographs_;
};

}  // namespace lumihull::slf
