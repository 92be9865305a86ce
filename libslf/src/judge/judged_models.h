#pragma once

// The renderers that are judged, and pictures of views besides the photographs.

#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/slf/evaluate.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace lumihull::slf {

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

/// What is judged, by its name in the evaluation.
using Methods = std::map<std::string, std::function<Rendering(const View&)>>;

/// "mean_texture", "lumigraph" (of the photographs that are not held out, on the same mesh) and, where a file is named,
/// "light_field". The job must outlive it.
class JudgedModels {
 public:
  /// Errors: those of read_glb, read_light_field and Lumigraph.
  JudgedModels(const Capture& capture, const std::filesystem::path& textured, const std::filesystem::path& light_field,
               const LumigraphOptions& lumigraph, const RenderOptions& render, Job& job);
  JudgedModels(const JudgedModels&) = delete;
  JudgedModels& operator=(const JudgedModels&) = delete;

  const Methods& methods() const { return methods_; }
  std::size_t triangles() const { return textured_.mesh.triangles.size(); }

 private:
  TexturedMesh textured_;
  hull::RayScene scene_;
  Lumigraph lumigraph_;
  std::optional<LightFieldRenderer> light_field_;
  Methods methods_;
};

/// Reference, rendering and four times their difference, side by side. 8-bit RGB of one size.
Image side_by_side(const Image& reference, const Image& picture);

/// Renders the views of a folder of truth (see EvaluateOptions::test_views) and compares. `placed`: from a view's
/// cam_from_world to that of the model's world; empty: the worlds are one. `pictures`: a folder for side_by_side's as
/// NAME.METHOD.png; empty: none are written. Errors: not_found, bad_input, io.
TestViewEvaluation evaluate_test_views(const std::filesystem::path& folder, const Methods& methods,
                                       const std::array<std::uint8_t, 3>& background,
                                       const std::function<Pose(const Pose&)>& placed,
                                       const std::filesystem::path& pictures, Job& job);

}  // namespace lumihull::slf
