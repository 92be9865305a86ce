#pragma once

// What the C interface and Python share: a capture's renderer, chosen by the method's name.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/lumigraph.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/renderer.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace lumihull {

/// Renders views of a capture by "lumigraph", "mean_texture" or "shaded". `scene_` and `lumigraph_` refer to `model_`:
/// the object stays where it was made. One thread at a time.
class CaptureRenderer {
 public:
  /// Errors: invalid_argument (method), not_found (what the method needs has not been made).
  CaptureRenderer(const Capture& capture, const std::string& method) {
    if (method != "lumigraph" && method != "mean_texture" && method != "shaded")
      throw Error(ErrorCode::invalid_argument,
                  "expected \"lumigraph\", \"mean_texture\" or \"shaded\", found \"" + method + "\"", "method");
    if (method == "mean_texture")
      model_ = slf::read_glb(existing(capture.folder() / "textured.glb", "texture"));
    else
      model_.mesh = hull::read_mesh(existing(capture.hull_path(), "hull"));
    scene_.emplace(model_.mesh);
    const auto shots = slf::training_shots(capture);
    for (const std::size_t i : shots) photographs_.push_back(capture.view(i));
    if (method == "lumigraph") lumigraph_.emplace(model_.mesh, *scene_, slf::photos_of(capture, shots));
  }
  CaptureRenderer(const CaptureRenderer&) = delete;
  CaptureRenderer& operator=(const CaptureRenderer&) = delete;

  slf::Rendering render(const View& view, const slf::RenderOptions& options, Job& job) {
    if (lumigraph_) return lumigraph_->render(view, options, job);
    if (!model_.texture.empty()) return slf::render_texture(model_, *scene_, view, options, job);
    return slf::render_shaded(model_.mesh, *scene_, view, options, job);
  }

  /// elevation_rad: above the horizon.
  std::vector<slf::PathView> turntable(int frames, int width, int height, double elevation_rad) const {
    slf::TurntableOptions options;
    options.frames = frames;
    options.width = width;
    options.height = height;
    options.elevation_deg = elevation_rad * 180 / std::numbers::pi;
    return slf::turntable(model_.mesh, photographs_, options);
  }

 private:
  static std::filesystem::path existing(const std::filesystem::path& file, const std::string& stage) {
    if (!std::filesystem::exists(file))
      throw Error(ErrorCode::not_found, "the file is missing; run the stage \"" + stage + "\" first", file.native());
    return file;
  }

  slf::TexturedMesh model_;  ///< without texture for the methods that need none
  std::optional<hull::RayScene> scene_;
  std::optional<slf::Lumigraph> lumigraph_;
  std::vector<View> photographs_;
};

}  // namespace lumihull
