#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/hull/region.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "explain.h"
#include "hull_function.h"
#include "occupancy.h"
#include "polytope.h"

namespace lumihull::hull {
namespace {

constexpr int kCells = 64;  // of the coarse carve, along each side
// Views that are looked at: fewer views leave a hull that contains the whole one's, and is hardly larger.
constexpr std::size_t kRegionViews = 40, kCoarseViews = 24;

bool constrains(const Silhouette& s) { return !s.is_empty() && !s.is_full(); }

/// The box around the intersection of the pyramids through the silhouettes that lie wholly in their pictures: it
/// contains the hull. nullopt where it is unbounded or empty.
std::optional<Box> intersect_pyramids(std::span<const View> views, std::span<const Silhouette> silhouettes) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const View& v : views) middle += v.center() / double(views.size());
  double reach = 0;
  for (const View& v : views) reach = std::max(reach, (v.center() - middle).norm());
  if (!(reach > 0)) return std::nullopt;
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(1000 * reach);
  Polytope polytope({middle - far, middle + far});
  for (std::size_t i = 0; i < views.size(); ++i) {
    const SilhouetteBounds& b = silhouettes[i].bounds();
    if (!constrains(silhouettes[i]) || b.touches_border) continue;
    const Eigen::Matrix<double, 3, 4> m = views[i].cam_from_world.matrix();
    for (const Eigen::RowVector3d& side :
         {Eigen::RowVector3d(1, 0, -b.min.x()), Eigen::RowVector3d(-1, 0, b.max.x()),
          Eigen::RowVector3d(0, 1, -b.min.y()), Eigen::RowVector3d(0, -1, b.max.y()), Eigen::RowVector3d(0, 0, 1)}) {
      const Eigen::RowVector4d plane = side * m;
      polytope.clip({plane.head<3>().transpose(), plane[3]});
    }
    if (polytope.empty()) return std::nullopt;
  }
  const Box box = polytope.bounds();
  const Eigen::Vector3d slack = 0.001 * far;
  if (((box.min - middle + far).array() < slack.array()).any() ||
      ((middle + far - box.max).array() < slack.array()).any())
    return std::nullopt;
  return box;
}

/// A cube around the point that the rays through the silhouettes' middles come nearest to.
std::optional<Box> meet_rays(std::span<const View> views, std::span<const Silhouette> silhouettes) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!constrains(silhouettes[i])) continue;
    const SilhouetteBounds& s = silhouettes[i].bounds();
    const Eigen::Vector2d middle = 0.5 * (s.min + s.max);
    const Eigen::Vector3d d =
        (views[i].cam_from_world.rotation.conjugate() * Eigen::Vector3d(middle.x(), middle.y(), 1)).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += across;
    b += across * views[i].center();
  }
  const internal::SymmetricAxes axes = internal::symmetric_axes(a);
  if (!(axes.values[0] > 1e-6 * axes.values[2])) return std::nullopt;
  const Eigen::Vector3d point = axes.vectors * (axes.vectors.transpose() * b).cwiseQuotient(axes.values);
  std::vector<double> halves;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double depth = (views[i].cam_from_world * point).z();
    const SilhouetteBounds& s = silhouettes[i].bounds();
    if (constrains(silhouettes[i]) && depth > 0) halves.push_back(0.5 * (s.max - s.min).maxCoeff() * depth);
  }
  if (halves.empty()) return std::nullopt;
  std::nth_element(halves.begin(), halves.begin() + std::ptrdiff_t(halves.size() / 2), halves.end());
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(1.3 * halves[halves.size() / 2]);
  if (!(half[0] > 0) || !half.allFinite()) return std::nullopt;
  return Box{point - half, point + half};
}

/// At most `most` views, as different as they can be, ascending: each next one is the farthest, in place and direction,
/// from those that were chosen (Gonzalez 1985). Every n-th would follow the trajectory's own period, and might see the
/// object from one side alone.
std::vector<std::size_t> spread(std::span<const View> views, std::size_t most) {
  const std::size_t n = views.size();
  std::vector<std::size_t> chosen;
  if (n <= most) {
    for (std::size_t i = 0; i < n; ++i) chosen.push_back(i);
    return chosen;
  }
  using Signature = Eigen::Matrix<double, 6, 1>;
  std::vector<Signature> signatures;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& v : views) mean += v.center() / double(n);
  double spread2 = 0;
  for (const View& v : views) spread2 += (v.center() - mean).squaredNorm() / double(n);
  const double unit = spread2 > 0 ? 1 / std::sqrt(spread2) : 0;
  for (const View& v : views) {
    // The middle of the picture: the principal point may lie far outside.
    const Eigen::Vector2d d = v.camera.distorted_from_pixel({0.5 * v.camera.width, 0.5 * v.camera.height});
    Signature s;
    s.head<3>() = (v.center() - mean) * unit;
    s.tail<3>() = (v.cam_from_world.rotation.conjugate() * Eigen::Vector3d(d.x(), d.y(), 1)).normalized();
    signatures.push_back(s);
  }
  std::vector<double> nearest(n, std::numeric_limits<double>::infinity());
  for (std::size_t next = 0; chosen.size() < most;) {
    chosen.push_back(next);
    for (std::size_t i = 0; i < n; ++i)
      nearest[i] = std::min(nearest[i], (signatures[i] - signatures[next]).squaredNorm());
    next = std::size_t(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

/// A rule for `chosen` of `all` views: as many bad ones among them as chance may bring.
CarveRule scaled(CarveRule rule, std::size_t chosen, std::size_t all) {
  if (chosen == all) return rule;
  if (rule.tolerance > 1)
    rule.tolerance = std::min(rule.tolerance, 2 + int(double(rule.tolerance) * double(chosen) / double(all)));
  rule.tolerance = std::clamp(rule.tolerance, 1, int(std::max<std::size_t>(chosen, 1)));
  rule.min_views = 1;
  return rule;
}

/// Makes a box's sides at least a thousandth of its longest: flat objects have a volume, too.
Box grown(Box box, double share) {
  const Eigen::Vector3d margin = (share * box.size()).cwiseMax(0.001 * box.size().maxCoeff());
  return {box.min - margin, box.max + margin};
}

/// Carves coarsely, grows the box where the hull goes on and tightens it; nullopt where it goes on without end.
std::optional<Box> search(const HullFunction& function, Box box, bool contains_hull, double share,
                          std::span<const std::string> names, Job& job) {
  const double first_size = box.size().maxCoeff();
  int empty = 0;
  for (int round = 0; round < 40; ++round) {
    job.check();
    Occupancy cells = occupancy(function.impl(), box, kCells, share, job);
    remove_specks(cells, 0.01);
    std::array<int, 3> first, last;
    if (!extent(cells, first, last)) {
      // A start by rays may have missed it.
      if (contains_hull || ++empty == 3) throw vanished(function, box, names, job);
      box = grown(box, 0.5);
      continue;
    }
    const Eigen::Vector3d cell = box.size() / kCells;
    Box tight, grow = box;
    bool touches = false;
    double fill = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = Eigen::Index(axis);
      tight.min[a] = box.min[a] + (first[axis] - 1) * cell[a];
      tight.max[a] = box.min[a] + (last[axis] + 2) * cell[a];
      if (first[axis] == 0) touches = true, grow.min[a] -= 0.3 * box.size()[a];
      if (last[axis] == kCells - 1) touches = true, grow.max[a] += 0.3 * box.size()[a];
      fill = std::max(fill, double(last[axis] - first[axis] + 1) / kCells);
    }
    if (touches) {
      if (grow.size().maxCoeff() > 100 * first_size) return std::nullopt;
      box = grow;
      continue;
    }
    if (fill > 0.7) return tight;
    box = tight;
  }
  return std::nullopt;
}

}  // namespace

Box find_region(std::span<const View> all_views, std::span<const Silhouette> all_silhouettes, const CarveRule& all_rule,
                std::span<const std::string> all_names, Job& job) {
  { const HullFunction valid(all_views, all_silhouettes, all_rule); }
  const std::vector<std::size_t> chosen = spread(all_views, kRegionViews);
  std::vector<View> views;
  std::vector<Silhouette> silhouettes;
  std::vector<std::string> names;
  for (const std::size_t i : chosen) {
    views.push_back(all_views[i]);
    silhouettes.push_back(all_silhouettes[i]);
    names.push_back(name_of(all_names, i));
  }
  const CarveRule rule = scaled(all_rule, chosen.size(), all_views.size());
  const HullFunction function(views, silhouettes, rule);
  const auto count = std::count_if(silhouettes.begin(), silhouettes.end(), constrains);
  if (count < 2)
    throw Error(
        ErrorCode::degenerate,
        "a region of space needs at least 2 silhouettes with object and background, not " + std::to_string(count));
  // With a tolerance single silhouettes prove nothing.
  std::optional<Box> start;
  if (rule.tolerance == 1) start = intersect_pyramids(views, silhouettes);
  const bool contains_hull = start.has_value();
  if (!start) start = meet_rays(views, silhouettes);
  if (!start)
    throw Error(ErrorCode::degenerate,
                "the views have no bounded region of space in common (they look along one direction); give a region");
  // A point that only a quarter as many views see as the best seen one counts, for the object may reach out of many
  // pictures. Where that goes on without end (few views, some of them along one direction), more views are asked for.
  for (const double share : {0.25, 0.5, 1.0})
    if (const auto box = search(function, grown(*start, 0.08), contains_hull, share, names, job)) return *box;
  throw Error(ErrorCode::degenerate, "the hull goes on without end: the views do not enclose it; give a region");
}

SilhouetteOptions silhouette_options(const View& view, const Box& region, int resolution) {
  const double voxel = make_grid(region, resolution).voxel;
  const double depth = (view.cam_from_world * region.center()).z();
  double nearest = depth;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p(corner & 1 ? region.max.x() : region.min.x(), corner & 2 ? region.max.y() : region.min.y(),
                            corner & 4 ? region.max.z() : region.min.z());
    nearest = std::min(nearest, (view.cam_from_world * p).z());
  }
  nearest = std::max(nearest, 0.25 * depth);
  SilhouetteOptions options;
  if (!(depth > 0)) return options;
  const double px = voxel * view.camera.f * std::max(1.0, view.camera.s);  // footprint at depth 1
  // Down to an eighth of an octave, for photographs of one cell share the lens's tables.
  options.cell_px = std::clamp(std::exp2(std::floor(8 * std::log2(0.25 * px / depth)) / 8), 1.0, 64.0);
  options.band_px = std::clamp(1.75 * px / nearest, 2.0, 1e4);
  return options;
}

std::vector<Silhouette> make_silhouettes(std::span<const View> views, const std::function<Image(std::size_t)>& load,
                                         const std::optional<Box>& region_in, int resolution, const CarveRule& rule,
                                         std::span<const std::string> names, Job& job) {
  const auto named = [&](std::size_t i, const auto& body) {
    try {
      return body();
    } catch (const Error& e) {
      if (!e.subject().empty()) throw;
      throw Error(e.code(), e.message(), name_of(names, i));
    }
  };
  std::optional<Box> region = region_in;
  if (!region && !views.empty()) {
    std::vector<std::optional<Silhouette>> coarse(views.size());
    const auto look_at = [&](const std::vector<std::size_t>& chosen) {
      parallel_for(job, chosen.size(), [&](std::size_t k) {
        const std::size_t i = chosen[k];
        coarse[i] = named(i, [&] {
          const Camera& camera = views[i].camera;
          const double cell = std::clamp(std::round(std::max(camera.width, camera.height) / 256.0), 1.0, 64.0);
          return Silhouette::from_mask(load(i), camera, {cell, 2 * cell});
        });
      });
    };
    const auto usable = [&](const auto& silhouette) { return silhouette && constrains(*silhouette); };
    const std::vector<std::size_t> chosen = spread(views, kCoarseViews);
    look_at(chosen);
    // Where most masks are empty or full, those that are not must be looked for among all.
    if (2 * std::size_t(std::count_if(coarse.begin(), coarse.end(), usable)) < chosen.size()) {
      std::vector<std::size_t> others;
      for (std::size_t i = 0; i < views.size(); ++i)
        if (!coarse[i]) others.push_back(i);
      look_at(others);
    }
    std::vector<View> some_views;
    std::vector<Silhouette> some;
    std::vector<std::string> some_names;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (!usable(coarse[i])) continue;
      some_views.push_back(views[i]);
      some.push_back(*coarse[i]);
      some_names.push_back(name_of(names, i));
    }
    if (some.size() < 2)
      throw Error(ErrorCode::degenerate, std::to_string(some.size()) + " of " + std::to_string(views.size()) +
                                             " masks have object and background; a hull needs at least 2");
    const CarveRule some_rule = scaled(rule, some.size(), views.size());
    region = find_region(some_views, some, some_rule, some_names, job);
  }

  std::vector<SilhouetteOptions> options(views.size());
  // Photographs of one camera share the lens's tables.
  using Key = std::array<double, 13>;
  std::map<Key, std::pair<std::size_t, std::optional<SilhouetteMaker>>> makers;
  std::vector<Key> keys(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    options[i] = named(i, [&] {
      views[i].camera.validate();
      return silhouette_options(views[i], *region, resolution);
    });
    const Camera& c = views[i].camera;
    keys[i] = {double(c.width),   double(c.height), c.f, c.s, c.skew, c.u0, c.v0, c.k1, c.k2, c.k3, c.p1, c.p2,
               options[i].cell_px};
    ++makers[keys[i]].first;
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto& [n, maker] = makers[keys[i]];
    if (n > 1 && !maker) maker = named(i, [&] { return SilhouetteMaker(views[i].camera, options[i].cell_px); });
  }
  std::vector<std::optional<Silhouette>> made(views.size());
  job.begin("distance fields", views.size());
  parallel_for(
      job, views.size(),
      [&](std::size_t i) {
        made[i] = named(i, [&] {
          const auto& maker = makers.at(keys[i]).second;
          return maker ? maker->make(load(i), options[i].band_px)
                       : Silhouette::from_mask(load(i), views[i].camera, options[i]);
        });
      },
      true);
  job.end();
  std::vector<Silhouette> result;
  result.reserve(made.size());
  for (auto& s : made) result.push_back(std::move(*s));
  return result;
}

}  // namespace lumihull::hull
