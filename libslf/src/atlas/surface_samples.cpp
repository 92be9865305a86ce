#include "surface_samples.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>

#include "color.h"

namespace lumihull::slf {
namespace {

constexpr float kFlatView = 1e-3f;  // what a view flatter than min_cosine still counts

std::uint8_t root_weight_of(float weight) {
  return std::uint8_t(std::clamp(std::round(128 * std::sqrt(weight)), 1.0f, 255.0f));
}

PhotoSamples samples_of(const SurfaceViewer& viewer, const Atlas& atlas, const View& view, const PreparedPhoto& photo,
                        const SampleOptions& options) {
  const std::size_t blocks = atlas.blocks.size() - 1;
  const SurfaceViewer::Projector projector(view);
  const auto ordinary_distance = float(options.ordinary_pixel * focal_length(view.camera));
  PhotoSamples out;
  out.center = projector.center;
  out.first.assign(blocks, kUnseen);
  std::vector<SeenTexel> seen;
  SurfaceViewer::Scratch scratch;
  for (std::size_t b = 0; b < blocks; ++b) {
    viewer.see(projector, b, seen, scratch);
    if (seen.empty()) continue;
    const std::size_t first = out.samples.size();
    out.first[b] = std::uint32_t(first);
    out.samples.resize(first + atlas.blocks[b + 1] - atlas.blocks[b], {});
    for (const SeenTexel& s : seen) {
      const PreparedPhoto::Sample c = photo.sample(s.pixel.x(), s.pixel.y());
      const float ratio = ordinary_distance / s.distance;
      float w = s.cosine * ratio * ratio * c.weight;
      if (s.cosine < options.min_cosine) w *= kFlatView;
      out.samples[first + s.texel - atlas.blocks[b]] = {srgb8_of_unit(c.r), srgb8_of_unit(c.g), srgb8_of_unit(c.b),
                                                        root_weight_of(w)};
    }
  }
  out.samples.shrink_to_fit();
  return out;
}

}  // namespace

std::vector<PhotoSamples> collect_samples(const SurfaceViewer& viewer, const Atlas& atlas, const PhotoSet& photos,
                                          const SampleOptions& options, Job& job) {
  std::vector<PhotoSamples> out(photos.size());
  job.begin("samples", photos.size());
  parallel_for(
      job, photos.size(),
      [&](std::size_t i) {
        const PreparedPhoto photo(photos.read(i), options.edge, photos.views[i].camera, photos.names[i]);
        out[i] = samples_of(viewer, atlas, photos.views[i], photo, options);
      },
      true);
  job.end();
  return out;
}

}  // namespace lumihull::slf
