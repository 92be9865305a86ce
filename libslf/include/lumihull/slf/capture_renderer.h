#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field.h>
#include <lumihull/slf/light_field_glb.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/results.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::slf {

/// Renders views of a capture by "light_field" (the factored model), "lumigraph" (blends photographs), "mean_texture"
/// (the textured model) or "shaded" (the bare hull); or of a model's file alone. `scene_` and `lumigraph_` refer to
/// `model_`: the object stays where it was made. One thread at a time.
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
    std::vector<View> photographs;
    for (const std::size_t i : shots) photographs.push_back(capture.view(i));
    up_ = up_axis(photographs);
    if (!photographs.empty()) first_ = photographs[0].center();
    if (method == "lumigraph") lumigraph_.emplace(model_.mesh, *scene_, photos_of(capture, shots));
  }
  /// A glTF binary: its light field where it has one, else its texture. Errors: those of read_light_field and read_glb.
  explicit CaptureRenderer(const std::filesystem::path& model) {
    if (has_light_field(model)) {
      const LightField field = slf::read_light_field(model);
      up_ = field.up.cast<double>();
      first_ = field.nodes[0].cast<double>();
      light_field_.emplace(field);
    } else {
      model_ = read_glb(model);
      scene_.emplace(model_.mesh);
    }
  }
  CaptureRenderer(const CaptureRenderer&) = delete;
  CaptureRenderer& operator=(const CaptureRenderer&) = delete;

  Rendering render(const View& view, const RenderOptions& options, Job& job) {
    if (light_field_) return light_field_->render(view, options, job);
    if (lumigraph_) return lumigraph_->render(view, options, job);
    if (!model_.texture.empty()) return render_texture(model_, *scene_, view, options, job);
    return render_shaded(model_.mesh, *scene_, view, options, job);
  }

  /// A full turn around the object, whose up is the photographs'; z where the file of a model does not know it.
  std::vector<PathView> turntable(const TurntableOptions& options) const {
    const hull::Mesh& mesh = light_field_ ? light_field_->mesh() : model_.mesh;
    return first_ ? slf::turntable(mesh, up_, *first_, options)
                  : slf::turntable(mesh, std::span<const View>(), options);
  }

 private:
  TexturedMesh model_;  ///< without texture for the methods that need none
  std::optional<hull::RayScene> scene_;
  std::optional<Lumigraph> lumigraph_;
  std::optional<LightFieldRenderer> light_field_;
  Eigen::Vector3d up_{0, 0, 1};
  std::optional<Eigen::Vector3d> first_;  ///< place of the first photograph, where it is known
};

}  // namespace lumihull::slf
