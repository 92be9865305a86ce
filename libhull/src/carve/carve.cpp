#include <lumihull/base/error.h>
#include <lumihull/hull/carve.h>
#include <lumihull/hull/region.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "explain.h"
#include "hull_function.h"

namespace lumihull::hull {

namespace {

/// Whether the views other than i keep a point. (View i's own word on its centre is rounding.)
bool inside_for_the_others(const HullFunction& function, std::size_t i, const Eigen::Vector3d& point) {
  int seen = 0, carvers = 0;
  for (std::size_t k = 0; k < function.views(); ++k) {
    const std::optional<double> phi = k == i ? std::nullopt : function.of_view(k, point);
    if (!phi) continue;
    ++seen;
    carvers += *phi >= 0;
  }
  const CarveRule& rule = function.impl().rule;
  return seen >= std::max(rule.min_views, rule.tolerance) && carvers < rule.tolerance;
}

}  // namespace

CarveResult carve(std::span<const View> views, std::span<const Silhouette> silhouettes, const CarveOptions& options,
                  Job& job) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  if (!(options.min_component >= 0 && options.min_component <= 1))
    throw Error(ErrorCode::invalid_argument, "min_component must be from 0 to 1");
  if (!options.names.empty() && options.names.size() != views.size())
    throw Error(ErrorCode::invalid_argument,
                std::to_string(options.names.size()) + " names for " + std::to_string(views.size()) + " views");
  if (options.resolution < kMinResolution || options.resolution > kMaxResolution)
    make_grid({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, options.resolution);  // says what is wrong
  const HullFunction function = [&] {
    try {
      return HullFunction(views, silhouettes, options.rule);
    } catch (const Error& e) {
      // Photographs are known by their names.
      if (options.names.empty() || e.subject().rfind("view ", 0) != 0) throw;
      throw Error(e.code(), e.message(), options.names[std::stoul(e.subject().substr(5))]);
    }
  }();

  CarveResult result;
  CarveStatistics& statistics = result.statistics;
  auto start = Clock::now();
  const Box region =
      options.region ? *options.region : find_region(views, silhouettes, options.rule, options.names, job);
  statistics.region_seconds = seconds_since(start);

  start = Clock::now();
  result.grid = make_grid(region, options.resolution);
  const Field field = sample_field(function, result.grid, job);
  statistics.field_seconds = seconds_since(start);
  statistics.samples_inside = field.samples_inside();
  statistics.samples_evaluated = field.samples_evaluated();
  statistics.views_evaluated = field.views_evaluated();
  statistics.field_bytes = field.bytes();
  statistics.least_band_voxels = INFINITY;
  for (std::size_t i = 0; i < views.size(); ++i) {
    statistics.silhouette_bytes += silhouettes[i].bytes();
    const double depth = (views[i].cam_from_world * result.grid.region.center()).z();
    if (depth > 0)
      statistics.least_band_voxels =
          std::min(statistics.least_band_voxels, silhouettes[i].band() * depth / result.grid.voxel);
  }
  if (statistics.samples_inside == 0) {
    if (const auto error = contradicted(function, views, silhouettes, options, job)) throw *error;
    throw vanished(function, region, options.names, job);
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!result.grid.region.contains(views[i].center()) || !inside_for_the_others(function, i, views[i].center()))
      continue;
    // A mask of something else may leave only a scrap around some camera: then it is not the camera that is wrong.
    if (const auto error = contradicted(function, views, silhouettes, options, job)) throw *error;
    throw Error(ErrorCode::degenerate,
                "the camera is inside the object that the other views see: check its pose and their masks",
                name_of(options.names, i));
  }

  start = Clock::now();
  result.mesh = extract_surface(field, job);
  statistics.specks_removed = remove_specks(result.mesh, options.min_component);
  statistics.mesh_seconds = seconds_since(start);
  return result;
}

}  // namespace lumihull::hull
