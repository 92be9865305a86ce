#include "coarse_hull.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace lumihull::hull {
namespace {

constexpr int kBlock = 8;  // voxels between exact projections; linear in between

/// Projections of a lattice of points over the grid, in coarse pixels; u is NaN where there is none.
struct Lattice {
  int points = 0;  ///< a side
  std::vector<Eigen::Vector2f> uv;
  const Eigen::Vector2f& at(int x, int y, int z) const {
    return uv[(std::size_t(z) * std::size_t(points) + std::size_t(y)) * std::size_t(points) + std::size_t(x)];
  }
};

Lattice project(const CoarseView& view, const Eigen::Vector3d& low, double voxel, int n) {
  Lattice lattice;
  lattice.points = n / kBlock + 1;
  for (int z = 0; z < lattice.points; ++z)
    for (int y = 0; y < lattice.points; ++y)
      for (int x = 0; x < lattice.points; ++x) {
        const auto px = view.view.project(low + voxel * kBlock * Eigen::Vector3d(x, y, z));
        lattice.uv.push_back(px ? Eigen::Vector2f((*px / view.step).cast<float>())
                                : Eigen::Vector2f(Eigen::Vector2f::Constant(std::nanf(""))));
      }
  return lattice;
}

/// Calls visit(x, u, v) for the voxels x of a row within a layer, u and v being their centres' coarse pixels.
template <class Visit>
void visit_row(const Lattice& lattice, int y, int z, Visit&& visit) {
  const int by = y / kBlock, bz = z / kBlock;
  const float fy = (float(y % kBlock) + 0.5f) / kBlock, fz = (float(z % kBlock) + 0.5f) / kBlock;
  const auto side = [&](int bx) -> Eigen::Vector2f {
    return (1 - fz) * ((1 - fy) * lattice.at(bx, by, bz) + fy * lattice.at(bx, by + 1, bz)) +
           fz * ((1 - fy) * lattice.at(bx, by, bz + 1) + fy * lattice.at(bx, by + 1, bz + 1));
  };
  Eigen::Vector2f from = side(0);
  for (int bx = 0; bx + 1 < lattice.points; ++bx) {
    const Eigen::Vector2f to = side(bx + 1), step = (to - from) / kBlock;
    for (int i = 0; i < kBlock; ++i) {
      const Eigen::Vector2f uv = from + (float(i) + 0.5f) * step;
      visit(bx * kBlock + i, uv.x(), uv.y());
    }
    from = to;
  }
}

/// Mean position of a mask's object pixels and the distance within which 98 % of them are; coarse pixels.
struct Blob {
  Eigen::Vector2d center{0, 0};
  double radius = 0;
};

std::optional<Blob> blob_of(const Image& mask) {
  double n = 0;
  Blob blob;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask.row<std::uint8_t>(y)[x] >= 128) blob.center += Eigen::Vector2d(x + 0.5, y + 0.5), ++n;
  if (n < 16) return std::nullopt;
  blob.center /= n;
  std::vector<double> histogram(std::size_t(mask.width() + mask.height() + 2), 0);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask.row<std::uint8_t>(y)[x] >= 128)
        ++histogram[std::size_t((Eigen::Vector2d(x + 0.5, y + 0.5) - blob.center).norm())];
  double left = 0.98 * n;
  while ((left -= histogram[std::size_t(blob.radius)]) > 0) ++blob.radius;
  ++blob.radius;
  return blob;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Centre and half side of a box that holds what the silhouettes show.
std::optional<std::pair<Eigen::Vector3d, double>> find_region(std::span<const CoarseView> views) {
  struct Sight {
    const CoarseView* view;
    Eigen::Vector3d from, direction;
    double radius;
  };
  std::vector<Sight> sights;
  for (const CoarseView& v : views) {
    const auto blob = blob_of(v.mask);
    if (!blob) continue;
    const auto ray = v.view.camera.ray(blob->center * v.step);
    if (!ray) continue;
    sights.push_back(
        {&v, v.view.center(), v.view.cam_from_world.rotation.conjugate() * ray->normalized(), blob->radius});
  }
  if (sights.size() < 2) return std::nullopt;
  // The point nearest to all rays, reweighted so that a few bad silhouettes do not pull it away.
  std::vector<double> weight(sights.size(), 1.0);
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int round = 0; round < 8; ++round) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < sights.size(); ++i) {
      const Eigen::Matrix3d across =
          weight[i] * (Eigen::Matrix3d::Identity() - sights[i].direction * sights[i].direction.transpose());
      a += across;
      b += across * sights[i].from;
    }
    Eigen::FullPivLU<Eigen::Matrix3d> lu(a);
    lu.setThreshold(1e-9);
    if (!lu.isInvertible()) return std::nullopt;
    point = lu.solve(b);
    std::vector<double> distance(sights.size());
    for (std::size_t i = 0; i < sights.size(); ++i)
      distance[i] = (point - sights[i].from).cross(sights[i].direction).norm();
    const double scale = std::max(median(distance), 1e-12);
    for (std::size_t i = 0; i < sights.size(); ++i) weight[i] = 1 / (1 + (distance[i] / scale) * (distance[i] / scale));
  }
  // Pixels to world units at that point.
  std::vector<double> radii;
  for (const Sight& s : sights) {
    Matrix23d jacobian;
    if (!s.view->view.camera.project(s.view->view.cam_from_world * point, &jacobian)) continue;
    radii.push_back(s.radius * s.view->step / (jacobian.norm() / std::sqrt(2.0)));
  }
  if (radii.size() < 2) return std::nullopt;
  std::sort(radii.begin(), radii.end());
  return std::pair(point, 1.5 * radii[radii.size() * 9 / 10]);
}

}  // namespace

std::vector<std::uint8_t> CoarseHull::vote(std::span<const CoarseView> views, const Grid& grid, double tolerance,
                                           Job& job) {
  const std::size_t n = std::size_t(grid.n), layer = n * n;
  std::vector<Lattice> lattices(views.size());
  parallel_for(job, views.size(),
               [&](std::size_t i) { lattices[i] = project(views[i], grid.low, grid.voxel, grid.n); });
  std::vector<std::uint8_t> kept(n * layer, 0);
  parallel_for(job, n, [&](std::size_t z) {
    std::vector<std::uint16_t> seen(layer, 0), against(layer, 0);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const CoarseView& v = views[i];
      const std::uint8_t* mask = v.mask.row<std::uint8_t>(0);
      const std::size_t width = std::size_t(v.mask.width());
      const float x0 = float(v.frame.x0), x1 = float(v.frame.x1), y0 = float(v.frame.y0), y1 = float(v.frame.y1);
      for (std::size_t y = 0; y < n; ++y)
        visit_row(lattices[i], int(y), int(z), [&](int x, float u, float w) {
          if (!(u >= x0 && u < x1 && w >= y0 && w < y1)) return;
          const std::size_t at = y * n + std::size_t(x);
          ++seen[at];
          against[at] = std::uint16_t(against[at] + (mask[std::size_t(w) * width + std::size_t(u)] < 128));
        });
    }
    const std::size_t least = std::max<std::size_t>(2, views.size() / 2);
    for (std::size_t i = 0; i < layer; ++i)
      kept[z * layer + i] = seen[i] >= least && double(against[i]) <= tolerance * double(seen[i]);
  });
  return kept;
}

std::optional<CoarseHull> CoarseHull::carve(std::span<const CoarseView> views, int resolution, double tolerance,
                                            Job& job) {
  if (views.size() < 2 || views.size() > 65535) return std::nullopt;
  const auto region = find_region(views);
  if (!region) return std::nullopt;
  CoarseHull hull;
  auto [center, half] = *region;
  const int n = (resolution + kBlock - 1) / kBlock * kBlock;
  // First in a box around everything, larger where the hull touches it; then in the box that the hull fills.
  for (int attempt = 0;; ++attempt) {
    hull.grid_ = {center - Eigen::Vector3d::Constant(half), 2 * half / n, n};
    hull.kept_ = vote(views, hull.grid_, tolerance, job);
    Eigen::Vector3i low = Eigen::Vector3i::Constant(n), high = Eigen::Vector3i::Constant(-1);
    for (int z = 0; z < n; ++z)
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          if (hull.kept_[(std::size_t(z) * std::size_t(n) + std::size_t(y)) * std::size_t(n) + std::size_t(x)]) {
            low = low.cwiseMin(Eigen::Vector3i(x, y, z));
            high = high.cwiseMax(Eigen::Vector3i(x, y, z));
          }
    if (high.x() < 0) return std::nullopt;
    const bool touches = low.minCoeff() == 0 || high.maxCoeff() == n - 1;
    const Eigen::Vector3i size = high - low + Eigen::Vector3i::Ones();
    if (attempt >= 4 || (!touches && size.maxCoeff() * 10 >= n * 8)) return hull;
    if (touches) {
      half *= 1.4;
      continue;
    }
    center = hull.grid_.low + hull.grid_.voxel * 0.5 * (low + high + Eigen::Vector3i::Ones()).cast<double>();
    half = hull.grid_.voxel * (0.5 * size.maxCoeff() + 2);
  }
}

double CoarseHull::voxel_px(const CoarseView& view) const {
  Matrix23d jacobian;
  if (!view.view.camera.project(view.view.cam_from_world * grid_.center(), &jacobian)) return 1;
  return grid_.voxel * jacobian.norm() / std::sqrt(2.0) / view.step;
}

int CoarseHull::margin_px(const CoarseView& view) const { return 3 + int(std::ceil(voxel_px(view))); }

Image CoarseHull::silhouette(const CoarseView& view, int grow) const {
  Image out(view.mask.width(), view.mask.height(), 1);
  const Lattice lattice = project(view, grid_.low, grid_.voxel, grid_.n);
  // A voxel covers a square as wide as its diagonal; overlapping squares leave no gaps.
  const int reach = int(std::ceil(0.5 * std::sqrt(3.0) * voxel_px(view))) + grow;
  for (int z = 0; z < grid_.n; ++z)
    for (int y = 0; y < grid_.n; ++y) {
      const std::uint8_t* kept =
          kept_.data() + (std::size_t(z) * std::size_t(grid_.n) + std::size_t(y)) * std::size_t(grid_.n);
      visit_row(lattice, y, z, [&](int x, float u, float v) {
        if (!kept[x] || !(u >= 0 && u < float(out.width()) && v >= 0 && v < float(out.height()))) return;
        out.row<std::uint8_t>(int(v))[int(u)] = 255;
      });
    }
  return grown(out, reach);
}

Image grown(const Image& mask, int radius) {
  const int width = mask.width(), height = mask.height();
  Image rows(width, height, 1), out(width, height, 1);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* in = mask.row<std::uint8_t>(y);
    std::uint8_t* to = rows.row<std::uint8_t>(y);
    int last = -radius - 1;  // the latest object pixel seen
    for (int x = -radius; x < width; ++x) {
      if (x + radius < width && in[x + radius] >= 128) last = x + radius;
      if (x >= 0 && last >= x - radius) to[x] = 255;
    }
  }
  std::vector<int> last(std::size_t(width), -radius - 1);
  for (int y = -radius; y < height; ++y) {
    if (y + radius < height) {
      const std::uint8_t* in = rows.row<std::uint8_t>(y + radius);
      for (int x = 0; x < width; ++x)
        if (in[x]) last[std::size_t(x)] = y + radius;
    }
    if (y < 0) continue;
    std::uint8_t* to = out.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x) to[x] = last[std::size_t(x)] >= y - radius ? 255 : 0;
  }
  return out;
}

Image shrunk(const Image& mask, int radius) {
  const auto inverted = [](Image image) {
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        image.row<std::uint8_t>(y)[x] = image.row<std::uint8_t>(y)[x] >= 128 ? 0 : 255;
    return image;
  };
  return inverted(grown(inverted(mask), radius));
}

}  // namespace lumihull::hull
