#include "source_ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::slf {
namespace {

constexpr std::size_t kAllSources = 40;  // so many photographs are looked at without a choice beforehand
constexpr std::size_t kPreselected = 32;
constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr float kSmallestAngle = 1e-3f;  // rad: nearer rays are the same ray

}  // namespace

struct SourceRanking::Candidate {
  std::uint32_t photo;
  float penalty;
};

SourceRanking::SourceRanking(const hull::RayScene& scene, float offset, const PhotoSet& photos,
                             const LumigraphOptions& options)
    : scene_(scene), offset_(offset), options_(options) {
  for (const View& view : photos.views)
    sources_.push_back({view, view.center().cast<float>(), float(view.camera.f * std::sqrt(view.camera.s))});
}

/// Radians between the new ray and the photograph's, and what a coarser picture costs; kNever from behind the surface.
float SourceRanking::penalty(const SurfacePoint& point, const Eigen::Vector3f& to_eye, const Source& source) const {
  const Eigen::Vector3f away = source.center - point.position;
  const float distance = away.norm();
  if (!(distance > 0)) return kNever;
  const Eigen::Vector3f to_source = away / distance;
  if (!(to_source.dot(point.normal) > 0)) return kNever;
  const float chord = (to_source - to_eye).norm();
  const float angle = 2 * std::asin(std::min(1.0f, 0.5f * chord));
  const float coarser = distance / (source.focal * point.spacing) - 1;
  return std::max(kSmallestAngle, angle) + float(options_.resolution_penalty) * std::max(0.0f, coarser);
}

std::vector<std::uint32_t> SourceRanking::nearest_sources(std::span<const SurfacePoint> points,
                                                          const Eigen::Vector3f& eye) const {
  std::vector<std::uint32_t> ids(sources_.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = std::uint32_t(i);
  if (ids.size() <= kAllSources) return ids;
  // The best over some points of the neighbourhood: it may hold a front and a far background.
  std::vector<float> best(ids.size(), kNever);
  const std::size_t step = std::max<std::size_t>(1, points.size() / 8);
  for (std::size_t p = 0; p < points.size(); p += step) {
    SurfacePoint point = points[p];
    const Eigen::Vector3f to_eye = (eye - point.position).normalized();
    for (std::size_t i = 0; i < ids.size(); ++i) best[i] = std::min(best[i], penalty(point, to_eye, sources_[i]));
  }
  std::partial_sort(ids.begin(), ids.begin() + kPreselected, ids.end(),
                    [&](std::uint32_t a, std::uint32_t b) { return best[a] != best[b] ? best[a] < best[b] : a < b; });
  ids.resize(kPreselected);
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Where a photograph sees the point, and the weight's factors that do not depend on the other photographs.
bool SourceRanking::project(const SurfacePoint& point, const Source& source, BlendSource& out) const {
  const Camera& camera = source.view.camera;
  Matrix23d by_camera;
  const auto pixel = camera.project(source.view.cam_from_world * point.position.cast<double>(), &by_camera);
  if (!pixel || !camera.contains(*pixel)) return false;
  const double border =
      std::min(std::min(pixel->x(), camera.width - pixel->x()), std::min(pixel->y(), camera.height - pixel->y()));
  const float inside = options_.border_px > 0 ? float(std::min(1.0, border / options_.border_px)) : 1.0f;
  const float cosine = (source.center - point.position).normalized().dot(point.normal);
  const float frontal = std::min(1.0f, cosine / std::max(float(options_.min_cosine), 1e-6f));
  if (!(inside > 0) || !(frontal > 0)) return false;
  out.weight = inside * frontal;
  out.pixel = pixel->cast<float>();
  out.jacobian = (by_camera * source.view.cam_from_world.rotation.toRotationMatrix()).cast<float>();
  return true;
}

std::vector<BlendSource> SourceRanking::rank(std::span<const SurfacePoint> points, const Eigen::Vector3f& eye) const {
  std::vector<BlendSource> result;
  if (points.empty()) return result;
  const std::size_t wanted = std::size_t(options_.photographs) + 1;  // one more: where the weights reach zero
  std::vector<std::uint32_t> ids = nearest_sources(points, eye);

  std::vector<std::vector<Candidate>> candidates(points.size());
  struct Found {
    BlendSource source;
    float penalty;
  };
  std::vector<std::vector<Found>> found(points.size());
  std::vector<std::size_t> next(points.size(), 0);
  const auto list_candidates = [&](std::size_t p, std::span<const std::uint32_t> among) {
    const Eigen::Vector3f to_eye = (eye - points[p].position).normalized();
    for (const std::uint32_t id : among) {
      const float value = penalty(points[p], to_eye, sources_[id]);
      if (value < kNever) candidates[p].push_back({id, value});
    }
    std::sort(candidates[p].begin(), candidates[p].end(), [](const Candidate& a, const Candidate& b) {
      return a.penalty != b.penalty ? a.penalty < b.penalty : a.photo < b.photo;
    });
  };
  for (std::size_t p = 0; p < points.size(); ++p) list_candidates(p, ids);

  // Rounds: every point asks for as many photographs as it still lacks; shadow rays to one photograph go together.
  struct Query {
    BlendSource source;
    float penalty;
  };
  std::vector<Query> queries;
  std::vector<hull::Ray> rays;
  std::vector<std::uint8_t> hidden;
  for (bool all_listed = ids.size() == sources_.size();;) {
    queries.clear();
    for (std::size_t p = 0; p < points.size(); ++p) {
      std::size_t lacking = wanted - std::min(wanted, found[p].size());
      for (; lacking > 0 && next[p] < candidates[p].size(); ++next[p]) {
        Query query{{std::uint32_t(p), candidates[p][next[p]].photo, 0, {}, {}}, candidates[p][next[p]].penalty};
        if (!project(points[p], sources_[query.source.photo], query.source)) continue;
        queries.push_back(query);
        --lacking;
      }
    }
    if (queries.empty()) {
      if (all_listed) break;
      // Some points still lack photographs after the preselected ones: now look at all of them.
      all_listed = true;
      std::vector<std::uint32_t> others;
      for (std::uint32_t i = 0, k = 0; i < sources_.size(); ++i) {
        if (k < ids.size() && ids[k] == i)
          ++k;
        else
          others.push_back(i);
      }
      for (std::size_t p = 0; p < points.size(); ++p)
        if (found[p].size() < wanted) candidates[p].clear(), next[p] = 0, list_candidates(p, others);
      continue;
    }
    std::stable_sort(queries.begin(), queries.end(),
                     [](const Query& a, const Query& b) { return a.source.photo < b.source.photo; });
    rays.clear();
    for (const Query& query : queries) {
      const SurfacePoint& point = points[query.source.point];
      const Eigen::Vector3f away = sources_[query.source.photo].center - point.position;
      const float distance = away.norm();
      rays.push_back({point.position, away / distance, std::min(offset_, 0.5f * distance), distance});
    }
    hidden.resize(rays.size());
    scene_.occluded(rays, hidden);
    for (std::size_t i = 0; i < queries.size(); ++i)
      if (!hidden[i]) found[queries[i].source.point].push_back({queries[i].source, queries[i].penalty});
  }

  for (std::size_t p = 0; p < points.size(); ++p) {
    auto& mine = found[p];
    if (mine.empty()) continue;
    std::sort(mine.begin(), mine.end(), [](const Found& a, const Found& b) {
      return a.penalty != b.penalty ? a.penalty < b.penalty : a.source.photo < b.source.photo;
    });
    // Where fewer photographs than that see the point, there is nothing to fade out for.
    const float limit = mine.size() == wanted ? mine.back().penalty : kNever;
    for (std::size_t i = 0; i < std::min(mine.size(), wanted - 1); ++i) {
      const float fade = std::max(1 - mine[i].penalty / limit, 1e-6f);
      mine[i].source.weight *= fade / std::pow(mine[i].penalty, float(options_.angle_power));
      result.push_back(mine[i].source);
    }
  }
  std::sort(result.begin(), result.end(), [](const BlendSource& a, const BlendSource& b) {
    return a.photo != b.photo ? a.photo < b.photo : a.point < b.point;
  });
  return result;
}

}  // namespace lumihull::slf
