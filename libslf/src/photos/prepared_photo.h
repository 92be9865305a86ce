#pragma once

#include <lumihull/slf/photos.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumihull::slf {

/// How the pixels next to a silhouette's edge count. They mix object and background, and the model's edge is never
/// quite the photograph's.
struct EdgeOptions {
  float erosion_px = 0;     ///< pixels nearer to the background than this have next to no weight
  float feather_px = 1;     ///< from there the weight rises to its full value over this width
  float edge_alpha = 0.5f;  ///< pixels of a softer mask take the colour of the nearest one beyond it
  bool clean_rim = false;   ///< so do those that are nothing but a mixture with the background (see Rim)
};

/// A photograph ready for blending: sRGB with a weight of 1 … 255 in the fourth byte. The eroded rim, pixels softer
/// than edge_alpha and all outside take the colour of the nearest pixel that is none of these; outside, the weight is
/// 1: such a place counts only where no other photograph knows better.
class PreparedPhoto {
 public:
  /// Throws Error{bad_input} naming the photograph where picture, mask and camera differ in size or type.
  PreparedPhoto(const Photo& photo, const EdgeOptions& edge, const Camera& camera, const std::string& name);

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t bytes() const { return pixels_.size() * sizeof(Pixel); }

  struct Sample {
    float r, g, b;  // sRGB, 0 … 1
    float weight;   // 0 … 1, > 0
  };
  /// Bilinear, each of the four pixels weighted by its own weight too. (u, v): centre of the first pixel = (0.5, 0.5);
  /// clamped to the picture.
  Sample sample(float u, float v) const;

 private:
  struct Pixel {
    std::uint8_t r, g, b, weight;
  };
  int width_, height_;
  std::vector<Pixel> pixels_;
};

}  // namespace lumihull::slf
