#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/textured_mesh.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "atlas.h"
#include "color.h"
#include "photo_options.h"
#include "prepared_photo.h"
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

/// Geometric mean of both focal lengths, px.
double focal_length(const Camera& camera) { return camera.f * std::sqrt(camera.s); }

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// World size of a pixel of the photograph that resolves a triangle best, median over the surface.
double finest_pixel(const hull::Mesh& mesh, const PhotoSet& photos) {
  std::vector<double> sizes;
  const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / 4000);
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    const Eigen::Vector3d n = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3;
    double best = std::numeric_limits<double>::infinity();
    for (const View& view : photos.views) {
      const Eigen::Vector3d away = view.center() - middle;
      const double distance = away.norm();
      if (!(away.dot(n) > 0.3 * distance)) continue;
      best = std::min(best, distance / focal_length(view.camera));
    }
    if (std::isfinite(best)) sizes.push_back(best);
  }
  if (sizes.empty()) {  // nothing is seen from the front: the size does not matter much
    for (const View& view : photos.views)
      sizes.push_back((view.center() - mesh.vertices[0].cast<double>()).norm() / focal_length(view.camera));
  }
  return std::max(median(sizes), 1e-30);
}

/// Adds photographs to the sums of all texels.
class Accumulator {
 public:
  Accumulator(const hull::Mesh& mesh, const hull::RayScene& scene, const Atlas& atlas, const PhotoSet& photos,
              const TextureOptions& options)
      : mesh_(mesh),
        scene_(scene),
        atlas_(atlas),
        options_(options),
        normals_(hull::vertex_normals(mesh)),
        sums_(atlas.texels.size()),
        offset_(shadow_offset(mesh, options.visibility_offset)) {
    // An ordinary photograph's pixel: weights are about 1 whatever the unit (see kTrusted of surface_fill.cpp).
    Eigen::AlignedBox3f box;
    for (const auto& v : mesh.vertices) box.extend(v);
    std::vector<double> sizes;
    for (const View& view : photos.views)
      sizes.push_back((view.center() - box.center().cast<double>()).norm() / focal_length(view.camera));
    ordinary_pixel_ = std::max(median(sizes), 1e-30);
  }

  void add(const View& view, const PreparedPhoto& photo, Job& job) {
    const std::size_t blocks = atlas_.blocks.size() - 1;
    const Projector projector(view);
    const auto ordinary_distance = float(ordinary_pixel_ * focal_length(view.camera));
    parallel_chunks(job, blocks, kBlocksAtOnce, [&](std::size_t first, std::size_t last) {
      std::vector<Seen> seen;
      std::vector<hull::Ray> rays;
      std::vector<std::uint8_t> hidden;
      for (std::size_t b = first; b < last; ++b) {
        candidates(atlas_.blocks[b], atlas_.blocks[b + 1], projector, ordinary_distance, seen);
        if (seen.empty()) continue;
        remove_hidden(seen, projector.center, rays, hidden);
        for (const Seen& s : seen) {
          const PreparedPhoto::Sample c = photo.sample(s.pixel.x(), s.pixel.y());
          const float w = s.weight * c.weight;
          BlendColor& sum = sums_[s.texel];
          sum.r += w * c.r, sum.g += w * c.g, sum.b += w * c.b, sum.weight += w;
        }
      }
    });
  }

  std::vector<BlendColor> take() { return std::move(sums_); }

 private:
  struct Seen {
    std::uint32_t texel;
    float weight;
    Eigen::Vector2f pixel;
    Eigen::Vector3f place;
  };

  /// Camera with what doesn't change from point to point. The lens is linearised over a block of texels (some pixels
  /// wide: the error is below a hundredth of a pixel); the perspective is exact.
  struct Projector {
    const Camera& camera;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    Eigen::Vector3f center;
    bool distorted;

    explicit Projector(const View& view)
        : camera(view.camera),
          rotation(view.cam_from_world.rotation.toRotationMatrix()),
          translation(view.cam_from_world.translation),
          center(view.center().cast<float>()),
          distorted(view.camera.has_distortion()) {}
  };

  struct LensPatch {
    Eigen::Vector2d corrected, distorted;
    Eigen::Matrix2d jacobian;
  };

  void candidates(std::uint32_t first, std::uint32_t last, const Projector& projector, float ordinary_distance,
                  std::vector<Seen>& seen) const {
    seen.clear();
    std::optional<LensPatch> patch;
    const Camera& camera = projector.camera;
    for (std::uint32_t i = first; i < last; ++i) {
      const Texel& texel = atlas_.texels[i];
      const auto& t = mesh_.triangles[texel.triangle];
      const float b0 = 1 - texel.b1 - texel.b2;
      const Eigen::Vector3f place =
          b0 * mesh_.vertices[t[0]] + texel.b1 * mesh_.vertices[t[1]] + texel.b2 * mesh_.vertices[t[2]];
      const Eigen::Vector3f normal = b0 * normals_[t[0]] + texel.b1 * normals_[t[1]] + texel.b2 * normals_[t[2]];
      const Eigen::Vector3f away = projector.center - place;
      const float facing = away.dot(normal);
      if (!(facing > 0)) continue;
      const Eigen::Vector3d p = projector.rotation * place.cast<double>() + projector.translation;
      if (!(p.z() > 0)) continue;
      Eigen::Vector2d lens(p.x() / p.z(), p.y() / p.z());
      if (projector.distorted) {
        if (!patch) {
          LensPatch fresh{lens, {}, {}};
          const auto d = camera.distort(lens, &fresh.jacobian);
          if (!d) continue;
          fresh.distorted = *d;
          patch = fresh;
        }
        lens = patch->distorted + patch->jacobian * (lens - patch->corrected);
      }
      const Eigen::Vector2d pixel = camera.pixel_from_distorted(lens);
      if (!camera.contains(pixel)) continue;
      const float distance = away.norm(), cosine = facing / (distance * std::max(normal.norm(), 1e-12f));
      float weight = std::pow(cosine, float(options_.cosine_power)) *
                     std::pow(ordinary_distance / distance, float(2 * options_.resolution_power));
      if (cosine < float(options_.min_cosine)) weight *= kFlatView;
      if (!(weight > 0)) continue;
      seen.push_back({i, weight, pixel.cast<float>(), place});
    }
  }

  /// Shadow rays for nine texels spread over the block, and for every one where these disagree.
  void remove_hidden(std::vector<Seen>& seen, const Eigen::Vector3f& center, std::vector<hull::Ray>& rays,
                     std::vector<std::uint8_t>& hidden) const {
    const auto ray_to = [&](const Seen& s) {
      const Eigen::Vector3f away = center - s.place;
      const float distance = away.norm();
      return hull::Ray{s.place, away / distance, std::min(offset_, 0.5f * distance), distance};
    };
    const std::size_t probes = std::min<std::size_t>(9, seen.size());
    rays.clear();
    for (std::size_t i = 0; i < probes; ++i)
      rays.push_back(ray_to(seen[probes > 1 ? i * (seen.size() - 1) / (probes - 1) : 0]));
    hidden.resize(probes);
    scene_.occluded(rays, hidden);
    const auto in_shadow = std::size_t(std::count(hidden.begin(), hidden.end(), std::uint8_t(1)));
    if (in_shadow == 0) return;
    if (in_shadow == probes) return seen.clear();
    rays.clear();
    for (const Seen& s : seen) rays.push_back(ray_to(s));
    hidden.resize(seen.size());
    scene_.occluded(rays, hidden);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < seen.size(); ++i)
      if (!hidden[i]) seen[kept++] = seen[i];
    seen.resize(kept);
  }

  const hull::Mesh& mesh_;
  const hull::RayScene& scene_;
  const Atlas& atlas_;
  const TextureOptions& options_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<BlendColor> sums_;
  float offset_;
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
      if (!(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1))
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
