#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/lumigraph.h>

#include <algorithm>
#include <cmath>

#include "frame.h"
#include "photos/photo_cache.h"
#include "photos/photo_options.h"
#include "source_ranking.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kTilesAtOnce =
    256;  // their samples and sources are in memory at a time: about 100 MB at 2 x 2 rays

void check(const LumigraphOptions& o) {
  constexpr const char* kWhose = "lumigraph options";
  require(o.photographs >= 1 && o.photographs <= 16, "photographs: expected 1 to 16", kWhose);
  require(o.angle_power >= 0 && o.angle_power <= 10, "angle_power: expected 0 to 10", kWhose);
  require(o.resolution_penalty >= 0 && o.resolution_penalty <= 10, "resolution_penalty: expected 0 to 10", kWhose);
  require(o.border_px >= 0 && o.border_px <= 1e4, "border_px: expected 0 to 10000", kWhose);
  check_photo_options(o, kWhose);
}

/// A tile on its way: the samples, which pixel's point each of them belongs to, and what they blend.
struct Work {
  Tile tile;
  std::vector<SurfaceSample> samples;
  std::vector<Eigen::Vector3f> offsets;     // of each sample from its point
  std::vector<std::uint32_t> first_sample;  // of each point, and one past the last
  std::vector<BlendSource> sources;         // by photograph, then point
  std::vector<BlendColor> sums;             // of each sample, weighted
  std::size_t next_source = 0;
};

}  // namespace

struct Lumigraph::Impl {
  const hull::Mesh& mesh;
  const hull::RayScene& scene;
  LumigraphOptions options;
  std::vector<Eigen::Vector3f> normals;
  PhotoCache cache;
  SourceRanking ranking;

  Impl(const hull::Mesh& m, const hull::RayScene& s, PhotoSet photos, const LumigraphOptions& o)
      : mesh(m),
        scene(s),
        options(o),
        normals(hull::vertex_normals(m)),
        cache(std::move(photos), edge_options(o), o.cache_bytes),
        ranking(s, shadow_offset(m, o.visibility_offset), cache.photos(), o) {}

  Eigen::Vector3f normal_at(const hull::Hit& hit) const {
    const auto& t = mesh.triangles[hit.triangle];
    const Eigen::Vector3f n = (1 - hit.b1 - hit.b2) * normals[t[0]] + hit.b1 * normals[t[1]] + hit.b2 * normals[t[2]];
    const float length = n.norm();
    return length > 1e-6f ? Eigen::Vector3f(n / length) : Eigen::Vector3f(0, 0, 0);
  }

  /// Rays of one pixel that meet the surface at about the same depth share their photographs and weights.
  void choose_sources(Work& work, const Eigen::Vector3f& eye, float pixel_angle) const {
    std::vector<SurfacePoint> points;
    const auto& samples = work.samples;
    for (std::size_t first = 0; first < samples.size();) {
      const SurfaceSample& s = samples[first];
      const float spacing = s.hit.t * pixel_angle;
      std::size_t last = first + 1;
      Eigen::Vector3f position = s.point, normal = normal_at(s.hit);
      while (last < samples.size() && samples[last].pixel == s.pixel &&
             (samples[last].point - s.point).squaredNorm() < 16 * spacing * spacing) {
        position += samples[last].point;
        normal += normal_at(samples[last].hit);
        ++last;
      }
      position /= float(last - first);
      if (!(normal.norm() > 1e-6f)) normal = eye - position;
      work.first_sample.push_back(std::uint32_t(first));
      for (std::size_t i = first; i < last; ++i) work.offsets.push_back(samples[i].point - position);
      points.push_back({position, normal.normalized(), spacing});
      first = last;
    }
    work.first_sample.push_back(std::uint32_t(samples.size()));
    work.sources = ranking.rank(points, eye);
    work.sums.resize(samples.size());
  }

  static void blend(Work& work, std::uint32_t id, const PreparedPhoto& photo) {
    for (; work.next_source < work.sources.size() && work.sources[work.next_source].photo == id; ++work.next_source) {
      const BlendSource& source = work.sources[work.next_source];
      for (std::uint32_t i = work.first_sample[source.point]; i < work.first_sample[source.point + 1]; ++i) {
        const Eigen::Vector2f px = source.pixel + source.jacobian * work.offsets[i];
        const PreparedPhoto::Sample c = photo.sample(px.x(), px.y());
        const float w = source.weight * c.weight;
        BlendColor& sum = work.sums[i];
        sum.r += w * c.r, sum.g += w * c.g, sum.b += w * c.b, sum.weight += w;
      }
    }
  }
};

Lumigraph::Lumigraph(const hull::Mesh& mesh, const hull::RayScene& scene, PhotoSet photos,
                     const LumigraphOptions& options) {
  check(options);
  validate(photos);
  if (photos.size() == 0) throw Error(ErrorCode::degenerate, "there is no photograph to blend");
  hull::validate(mesh, "mesh");
  impl_ = std::make_unique<Impl>(mesh, scene, std::move(photos), options);
}

Lumigraph::Lumigraph(Lumigraph&&) noexcept = default;
Lumigraph& Lumigraph::operator=(Lumigraph&&) noexcept = default;
Lumigraph::~Lumigraph() = default;

Rendering Lumigraph::render(const View& view, const RenderOptions& options, Job& job) {
  Frame frame(view, options, impl_->mesh, impl_->scene);
  const Eigen::Vector3f eye = frame.center().cast<float>();
  const float pixel_angle = float(1 / (view.camera.f * std::sqrt(view.camera.s)));
  job.begin("rendering", 2 * frame.tiles());
  for (std::size_t first = 0; first < frame.tiles(); first += kTilesAtOnce) {
    std::vector<Work> works(std::min(kTilesAtOnce, frame.tiles() - first));
    parallel_for(
        job, works.size(),
        [&](std::size_t i) {
          Work& work = works[i];
          work.tile = frame.tile(first + i);
          work.samples = frame.trace(work.tile);
          if (!work.samples.empty()) impl_->choose_sources(work, eye, pixel_angle);
        },
        true);

    // Photographs in ascending order, some at a time; the sums therefore do not depend on how many at a time.
    std::vector<std::uint8_t> used(impl_->cache.photos().size(), 0);
    for (const Work& work : works)
      for (const BlendSource& source : work.sources) used[source.photo] = 1;
    std::vector<std::uint32_t> ids;
    for (std::uint32_t i = 0; i < used.size(); ++i)
      if (used[i]) ids.push_back(i);
    const std::size_t at_once = std::max(4u, job.threads());
    for (std::size_t begin = 0; begin < ids.size(); begin += at_once) {
      const auto batch = std::span(ids).subspan(begin, std::min(at_once, ids.size() - begin));
      const auto photos = impl_->cache.get(batch, job);
      parallel_for(job, works.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < batch.size(); ++k) Impl::blend(works[i], batch[k], *photos[k]);
      });
    }

    parallel_for(
        job, works.size(),
        [&](std::size_t i) {
          Work& work = works[i];
          for (BlendColor& c : work.sums)
            if (c.weight > 0) c = {c.r / c.weight, c.g / c.weight, c.b / c.weight, 1};
          frame.resolve(work.tile, work.samples, work.sums);
        },
        true);
  }
  job.end();
  return frame.finish();
}

}  // namespace lumihull::slf
