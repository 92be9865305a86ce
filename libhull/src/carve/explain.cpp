#include "explain.h"

#include <lumihull/base/parallel.h>
#include <lumihull/hull/region.h>

#include <algorithm>
#include <cmath>

#include "hull_function.h"

namespace lumihull::hull {
namespace {

constexpr int kSide = 32;

}  // namespace

Explanation explain(const HullFunction& function, const Box& region, Job& job) {
  const Grid grid = make_grid(region, kSide);
  const auto [nx, ny, nz] = grid.size;
  const std::size_t samples = std::size_t(nx) * ny * nz, views = function.views();
  struct Sample {
    std::uint32_t carvers = 0, seen = 0, last = 0;  // last: one of the carvers
  };
  std::vector<Sample> of(samples);
  const auto position = [&, nx = nx, ny = ny](std::size_t s) {
    return grid.sample(int(s % nx), int(s / nx % ny), int(s / nx / ny));
  };
  parallel_chunks(job, samples, 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s) {
      const Eigen::Vector3d x = position(s);
      for (std::size_t i = 0; i < views; ++i) {
        const double phi = function.impl().views[i].phi(x);
        if (std::isnan(phi)) continue;
        ++of[s].seen;
        if (phi >= 0) ++of[s].carvers, of[s].last = std::uint32_t(i);
      }
    }
  });
  Explanation result;
  for (const Sample& s : of) result.best_seen = std::max<std::size_t>(result.best_seen, s.seen);
  const auto counts = [&](const Sample& s) { return s.seen > 0 && 2 * s.seen >= result.best_seen; };
  result.fewest_carvers = views;
  for (const Sample& s : of)
    if (counts(s)) result.fewest_carvers = std::min<std::size_t>(result.fewest_carvers, s.carvers);

  std::vector<std::size_t> carved(views), alone(views);
  std::size_t kept = 0, fewest = 0;
  for (std::size_t s = 0; s < samples; ++s) {
    if (!counts(of[s])) continue;
    kept += of[s].carvers == 0;
    if (of[s].carvers == 1) ++alone[of[s].last];
    if (of[s].carvers != std::max<std::size_t>(result.fewest_carvers, 1) || fewest >= 4096) continue;
    ++fewest;
    const Eigen::Vector3d x = position(s);
    for (std::size_t i = 0; i < views; ++i) carved[i] += function.impl().views[i].phi(x) >= 0;
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < views; ++i)
    if (carved[i] > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return carved[a] > carved[b]; });
  for (const std::size_t i : order)
    result.suspects.push_back({i, double(alone[i]) / double(std::max<std::size_t>(alone[i] + kept, 1))});
  return result;
}

namespace {

Error carved_away(const Explanation& why, std::size_t views, std::span<const std::string> names) {
  std::string list;
  std::size_t named = 0;
  for (; named < why.suspects.size() && named < std::max<std::size_t>(why.fewest_carvers, 1) && named < 8; ++named)
    list += (named ? ", " : "") + name_of(names, why.suspects[named].view);
  if (named < why.fewest_carvers) list += " and others";
  return Error(ErrorCode::degenerate,
               "the hull vanishes: every point is carved away by at least " + std::to_string(why.fewest_carvers) +
                   " of " + std::to_string(views) + " views; where it is fewest, by " + list +
                   ": check their masks and poses",
               name_of(names, why.suspects.empty() ? 0 : why.suspects[0].view));
}

}  // namespace

std::optional<Error> contradicted(const HullFunction& function, std::span<const View> views,
                                  std::span<const Silhouette> silhouettes, const CarveOptions& options, Job& job) {
  for (int tolerance = options.rule.tolerance + 1; std::size_t(4 * tolerance) <= views.size() + 4; tolerance *= 2) {
    CarveRule rule = options.rule;
    rule.tolerance = tolerance;
    Box region;
    try {
      region = options.region ? *options.region : find_region(views, silhouettes, rule, options.names, job);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::degenerate) throw;
      continue;
    }
    const Explanation why = explain(function, region, job);
    if (2 * why.best_seen >= views.size() && why.fewest_carvers >= std::size_t(options.rule.tolerance) &&
        why.fewest_carvers < std::size_t(tolerance))
      return carved_away(why, views.size(), options.names);
  }
  return std::nullopt;
}

Error vanished(const HullFunction& function, const Box& region, std::span<const std::string> names, Job& job) {
  const Explanation why = explain(function, region, job);
  if (why.best_seen == 0) return Error(ErrorCode::degenerate, "the hull vanishes: no view sees the region of space");
  if (why.fewest_carvers < std::size_t(function.impl().rule.tolerance))
    return Error(
        ErrorCode::degenerate,
        "the hull vanishes: it is thinner than a voxel, or cut away; raise the resolution or shrink the region");
  return carved_away(why, function.views(), names);
}

}  // namespace lumihull::hull
