#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "atlas.h"
#include "color.h"
#include "photos/photo_options.h"
#include "photos/prepared_photo.h"
#include "render/surface_viewer.h"
#include "surface_fill.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kBlocksAtOnce = 64;  // a chunk of parallel work
constexpr float kFlatView = 1e-3f;         // what a view flatter than min_cosine still counts

void check(const TextureOptions& o) {
  constexpr const char* kWhose = "texture options";
  require(o.max_side >= 64 && o.max_side <= 16384, "max_side: expected 64 to 16384", kWhose);
  require(o.texel_px >= 0.1 && o.texel_px <= 100, "texel_px: expected 0.1 to 100", kWhose);
  require(o.cosine_power >= 0 && o.cosine_power <= 20, "cosine_power: expected 0 to 20", kWhose);
  require(o.resolution_power >= 0 && o.resolution_power <= 10, "resolution_power: expected 0 to 10", kWhose);
  check_photo_options(o, kWhose);
}

/// Adds photographs to the sums of all texels.
class Accumulator {
 public:
  Accumulator(const hull::Mesh& mesh, const hull::RayScene& scene, const Atlas& atlas, const PhotoSet& photos,
              const TextureOptions& options)
      : viewer_(mesh, scene, atlas, shadow_offset(mesh, options.visibility_offset)),
        blocks_(atlas.blocks.size() - 1),
        options_(options),
        sums_(atlas.texels.size()),
        // An ordinary photograph's pixel: weights are about 1 whatever the unit (see kTrusted of surface_fill.cpp).
        ordinary_pixel_(ordinary_pixel(mesh, photos)) {}

  void add(const View& view, const PreparedPhoto& photo, Job& job) {
    const SurfaceViewer::Projector projector(view);
    const auto ordinary_distance = float(ordinary_pixel_ * focal_length(view.camera));
    parallel_chunks(job, blocks_, kBlocksAtOnce, [&](std::size_t first, std::size_t last) {
      std::vector<SeenTexel> seen;
      SurfaceViewer::Scratch scratch;
      for (std::size_t b = first; b < last; ++b) {
        viewer_.see(projector, b, seen, scratch);
        for (const SeenTexel& s : seen) {
          const PreparedPhoto::Sample c = photo.sample(s.pixel.x(), s.pixel.y());
          float w = std::pow(s.cosine, float(options_.cosine_power)) *
                    std::pow(ordinary_distance / s.distance, float(2 * options_.resolution_power)) * c.weight;
          if (s.cosine < float(options_.min_cosine)) w *= kFlatView;
          BlendColor& sum = sums_[s.texel];
          sum.r += w * c.r, sum.g += w * c.g, sum.b += w * c.b, sum.weight += w;
        }
      }
    });
  }

  std::vector<BlendColor> take() { return std::move(sums_); }

 private:
  SurfaceViewer viewer_;
  std::size_t blocks_;
  const TextureOptions& options_;
  std::vector<BlendColor> sums_;
  double ordinary_pixel_;  // world units
};

}  // namespace

void validate(const TexturedMesh& textured, const std::string& name) {
  hull::validate(textured.mesh, name);
  if (textured.uv.size() != textured.mesh.triangles.size())
    throw Error(ErrorCode::bad_input, "expected texture coordinates for each triangle", name);
  if (textured.texture.empty() || textured.texture.type() != PixelType::u8 || textured.texture.channels() != 3)
    throw Error(ErrorCode::bad_input, "expected an 8-bit RGB texture", name);
  for (std::size_t i = 0; i < textured.uv.size(); ++i)
    for (const auto& uv : textured.uv[i])
      if (!((uv.array() >= 0).all() && (uv.array() <= 1).all()))  // no for NaN, too
        throw Error(ErrorCode::bad_input, "triangle " + std::to_string(i) + " has texture coordinates outside 0 to 1",
                    name);
}

TexturedMesh mean_texture(const hull::Mesh& mesh, const PhotoSet& photos, const TextureOptions& options, Job& job,
                          TextureReport* report) {
  check(options);
  validate(photos);
  hull::validate(mesh, "mesh");
  if (photos.size() == 0) throw Error(ErrorCode::degenerate, "there is no photograph to take colours from");
  if (mesh.triangles.empty()) throw Error(ErrorCode::degenerate, "the mesh has no triangles to colour");

  const hull::RayScene scene(mesh);
  const Atlas atlas = make_atlas(mesh, options.texel_px * finest_pixel(mesh, photos), options.max_side);

  // One photograph's pixels at a time; the next few are read while nothing else needs the threads.
  const EdgeOptions edge = edge_options(options);
  Accumulator accumulator(mesh, scene, atlas, photos, options);
  job.begin("texture", photos.size());
  const std::size_t at_once = std::max(1u, std::min(job.threads(), 8u));
  for (std::size_t first = 0; first < photos.size(); first += at_once) {
    std::vector<std::unique_ptr<PreparedPhoto>> batch(std::min(at_once, photos.size() - first));
    parallel_for(job, batch.size(), [&](std::size_t i) {
      const std::size_t id = first + i;
      batch[i] = std::make_unique<PreparedPhoto>(photos.read(id), edge, photos.views[id].camera, photos.names[id]);
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      accumulator.add(photos.views[first + i], *batch[i], job);
      batch[i].reset();
      job.advance();
    }
  }
  std::vector<BlendColor> colors = accumulator.take();
  const std::size_t filled = fill_surface(mesh, atlas, colors);

  TexturedMesh textured;
  textured.mesh = mesh;
  textured.uv = atlas.uv;
  const Eigen::Vector2f size(float(atlas.width), float(atlas.height));
  for (auto& corners : textured.uv)
    for (auto& uv : corners) uv = uv.cwiseQuotient(size).cwiseMax(0.0f).cwiseMin(1.0f);
  textured.texture = texture_picture(atlas, colors);
  job.end();
  if (report)
    *report = {atlas.charts, atlas.texel_size, double(filled) / double(std::max<std::size_t>(1, colors.size()))};
  return textured;
}

}  // namespace lumihull::slf
