// The hull against the true surface.
#include <lumihull/base/parallel.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/hull/surface_distance.h>

#include <algorithm>
#include <cmath>

#include "parts.h"
#include "render/view_rays.h"
#include "spread.h"
#include "stages/stage.h"

namespace lumihull::slf::truth {
namespace {

constexpr std::size_t kChunk = 1024;

struct Distances {
  std::vector<double> mm;
  std::vector<double> outside_mm;  ///< of points that `to` does not enclose; where asked for
};

/// Evenly over `from`, and its vertices besides for the largest: they are where surfaces stick out most.
Distances distances(const hull::Mesh& from, const hull::SurfaceDistance& to, std::size_t samples, bool outside,
                    Job& job) {
  const std::vector<Eigen::Vector3f> points = hull::surface_points(from, samples);
  Distances d;
  d.mm.resize(points.size());
  std::vector<std::uint8_t> out(points.size());
  parallel_chunks(job, points.size(), kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      d.mm[i] = 1000 * double(to(points[i]));
      if (outside) out[i] = !to.encloses(points[i]);
    }
  });
  for (std::size_t i = 0; i < points.size(); ++i)
    if (out[i]) d.outside_mm.push_back(d.mm[i]);
  return d;
}

double largest_of_vertices(const hull::Mesh& from, const hull::SurfaceDistance& to, Job& job) {
  std::vector<double> most((from.vertices.size() + kChunk - 1) / kChunk);
  parallel_chunks(job, from.vertices.size(), kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      most[first / kChunk] = std::max(most[first / kChunk], 1000 * double(to(from.vertices[i])));
  });
  return most.empty() ? 0 : *std::max_element(most.begin(), most.end());
}

/// The same view in a picture of at most so many pixels.
View reduced(View view, int side) {
  Camera& c = view.camera;
  const double n = std::max(1.0, std::max(c.width, c.height) / double(side));
  c.width = std::max(1, int(c.width / n)), c.height = std::max(1, int(c.height / n));
  c.f /= n, c.skew /= n, c.u0 /= n, c.v0 /= n;
  return view;
}

/// Of what both meshes cover, by a ray through each pixel's middle.
double iou(const hull::RayScene& a, const hull::RayScene& b, const View& view) {
  const ViewRays rays(view);
  const auto w = std::size_t(view.camera.width);
  const Eigen::Vector3f eye = view.center().cast<float>();
  std::vector<double> u(w), v(w);
  std::vector<float> x(w), y(w), z(w);
  std::vector<hull::Hit> hit_a(w), hit_b(w);
  std::size_t both = 0, any = 0;
  for (int row = 0; row < view.camera.height; ++row) {
    for (std::size_t i = 0; i < w; ++i) u[i] = double(i) + 0.5, v[i] = row + 0.5;
    rays.fill(w, u.data(), v.data(), x.data(), y.data(), z.data());
    a.hit(eye, {x, y, z}, hit_a);
    b.hit(eye, {x, y, z}, hit_b);
    for (std::size_t i = 0; i < w; ++i) {
      both += hit_a[i] && hit_b[i];
      any += hit_a[i] || hit_b[i];
    }
  }
  return any ? double(both) / double(any) : 1;
}

/// The side of a voxel, as far as the capture tells: its region is little larger than the hull.
double voxel_mm(const Capture& capture, const hull::Mesh& hull, double scale) {
  const double resolution = double(effective<std::int64_t>(capture, "hull", "resolution"));
  if (const auto region = effective<std::vector<double>>(capture, "hull", "region"); region.size() == 6)
    return 1000 * scale * std::max({region[3] - region[0], region[4] - region[1], region[5] - region[2]}) / resolution;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : hull.vertices) box.extend(p);
  return 1000 * scale * double(box.sizes().maxCoeff()) / resolution;
}

}  // namespace

SurfaceTruth compare_surface(const Capture& capture, hull::Mesh hull, const hull::Mesh& truth,
                             const Similarity& truth_from_capture, std::span<const Pair> pairs,
                             const TruthOptions& options, Job& job) {
  SurfaceTruth out;
  out.voxel_mm = voxel_mm(capture, hull, truth_from_capture.scale);
  for (Eigen::Vector3f& p : hull.vertices) p = (truth_from_capture * p.cast<double>()).cast<float>();
  std::vector<const Pair*> shown;
  const std::size_t views = std::min(pairs.size(), std::size_t(options.silhouette_views));
  for (std::size_t i = 0; i < views; ++i) shown.push_back(&pairs[i * pairs.size() / views]);
  job.begin("surface beside the truth", 4 + shown.size());
  {
    const hull::SurfaceDistance to_truth(truth), to_hull(hull);
    out.hull_to_truth_mm = spread_of(distances(hull, to_truth, options.surface_samples, false, job).mm);
    job.advance();
    Distances back = distances(truth, to_hull, options.surface_samples, true, job);
    job.advance();
    out.outside_mm = options.outside_mm;
    std::size_t cut = 0;
    for (const double mm : back.outside_mm) {
      cut += mm > options.outside_mm;
      out.outside_max_mm = std::max(out.outside_max_mm, mm);
    }
    out.outside_share = double(cut) / double(back.mm.size());
    out.truth_to_hull_mm = spread_of(std::move(back.mm));
    out.hull_to_truth_mm.max = std::max(out.hull_to_truth_mm.max, largest_of_vertices(hull, to_truth, job));
    job.advance();
    out.truth_to_hull_mm.max = std::max(out.truth_to_hull_mm.max, largest_of_vertices(truth, to_hull, job));
    job.advance();
  }
  if (const double volume = hull::enclosed_volume(truth); volume > 0)
    out.volume_ratio = hull::enclosed_volume(hull) / volume;
  out.silhouettes.resize(shown.size());
  const hull::RayScene hull_scene(hull), true_scene(truth);
  parallel_for(
      job, shown.size(),
      [&](std::size_t i) {
        out.silhouettes[i] = {capture.shots[shown[i]->shot].name,
                              iou(hull_scene, true_scene, reduced(shown[i]->truth, options.silhouette_side_px))};
      },
      true);
  job.end();
  if (shown.empty()) return out;
  out.iou_mean = 0, out.iou_least = 1;
  for (const SurfaceTruth::Shot& s : out.silhouettes) {
    out.iou_mean += s.iou;
    out.iou_least = std::min(out.iou_least, s.iou);
  }
  out.iou_mean /= double(shown.size());
  return out;
}

}  // namespace lumihull::slf::truth
