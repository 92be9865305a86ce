#pragma once

#include <lumihull/base/job.h>
#include <lumihull/slf/photos.h>

#include <array>
#include <cstdint>
#include <vector>

#include "atlas.h"
#include "color.h"
#include "photos/prepared_photo.h"
#include "render/surface_viewer.h"

namespace lumihull::slf {

/// What a photograph says of a texel: its colour there (8-bit sRGB) and how much that counts.
struct SurfaceSample8 {
  std::uint8_t r, g, b;
  std::uint8_t root_weight;  // weight = (root_weight / 128)²; 0: not seen. An ordinary frontal view has weight 1

  float weight() const {
    const float root = float(root_weight) * (1.0f / 128);
    return root * root;
  }
};

inline std::array<float, 3> color_of(const SurfaceSample8& s) {
  return {unit_of_srgb8(s.r), unit_of_srgb8(s.g), unit_of_srgb8(s.b)};
}

/// The samples of one photograph, in whole blocks of the atlas; blocks that it doesn't see take no room.
struct PhotoSamples {
  Eigen::Vector3f center;
  std::vector<std::uint32_t> first;  // of each block, in `samples`; kUnseen
  std::vector<SurfaceSample8> samples;
};
inline constexpr std::uint32_t kUnseen = ~std::uint32_t(0);

struct SampleOptions {
  EdgeOptions edge;
  float min_cosine = 0.15f;
  double ordinary_pixel = 1;  // world units: weights are about 1 where a photograph's pixel is so large
};

/// Looks at every photograph once. The weight is the number of the photograph's pixels that a texel covers (cosine /
/// distance², in units of an ordinary pixel), times the pixel's own weight. Memory: four bytes a sample.
std::vector<PhotoSamples> collect_samples(const SurfaceViewer& viewer, const Atlas& atlas, const PhotoSet& photos,
                                          const SampleOptions& options, Job& job);

}  // namespace lumihull::slf
