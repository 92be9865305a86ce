#include "coarse_hull.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace lumihull::hull {
namespace {

constexpr int kBlock = 8;       // voxels between exact projections; linear in between
constexpr int kDeepest = 15;    // of the depths, voxels
constexpr int kFirstShare = 2;  // the box is found at a resolution so many times coarser

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

/// Calls visit(x, u, v) for the voxels x of a row within a layer, u and v being their centres' coarse pixels; not for
/// blocks b of voxels with !wanted(b).
template <class Wanted, class Visit>
void visit_row(const Lattice& lattice, int y, int z, Wanted&& wanted, Visit&& visit) {
  const int by = y / kBlock, bz = z / kBlock;
  const float fy = (float(y % kBlock) + 0.5f) / kBlock, fz = (float(z % kBlock) + 0.5f) / kBlock;
  const auto side = [&](int bx) -> Eigen::Vector2f {
    return (1 - fz) * ((1 - fy) * lattice.at(bx, by, bz) + fy * lattice.at(bx, by + 1, bz)) +
           fz * ((1 - fy) * lattice.at(bx, by, bz + 1) + fy * lattice.at(bx, by + 1, bz + 1));
  };
  for (int bx = 0; bx + 1 < lattice.points; ++bx) {
    if (!wanted(bx)) continue;
    const Eigen::Vector2f from = side(bx), step = (side(bx + 1) - from) / kBlock;
    for (int i = 0; i < kBlock; ++i) {
      const Eigen::Vector2f uv = from + (float(i) + 0.5f) * step;
      visit(bx * kBlock + i, uv.x(), uv.y());
    }
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
  // Every so many-th view, so that views that follow each other see the object from different sides, and most of the
  // box is decided by the first few.
  const std::size_t count = views.size();
  std::size_t stride = std::max<std::size_t>(1, std::size_t(double(count) * 0.38));
  while (std::gcd(stride, count) != 1) ++stride;
  const double most = tolerance * double(count);  // a voxel with more views against it is gone, whoever else sees it
  const std::size_t blocks = n / kBlock;
  parallel_for(job, n, [&](std::size_t z) {
    std::vector<std::uint16_t> seen(layer, 0), against(layer, 0);
    std::vector<std::uint8_t> open(n * blocks, 1);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = k * stride % count;
      const CoarseView& v = views[i];
      const std::uint8_t* mask = v.mask.row<std::uint8_t>(0);
      const std::size_t width = std::size_t(v.mask.width());
      const float x0 = float(v.frame.x0), x1 = float(v.frame.x1), y0 = float(v.frame.y0), y1 = float(v.frame.y1);
      for (std::size_t y = 0; y < n; ++y)
        visit_row(
            lattices[i], int(y), int(z),
            [&](int block) {
              std::uint8_t& is_open = open[y * blocks + std::size_t(block)];
              if (!is_open) return false;
              const std::uint16_t* a = &against[y * n + std::size_t(block) * kBlock];
              return (is_open = double(*std::min_element(a, a + kBlock)) <= most) != 0;
            },
            [&](int x, float u, float w) {
              if (!(u >= x0 && u < x1 && w >= y0 && w < y1)) return;
              const std::size_t at = y * n + std::size_t(x);
              ++seen[at];
              against[at] = std::uint16_t(against[at] + (mask[std::size_t(w) * width + std::size_t(u)] < 128));
            });
    }
    const std::size_t least = std::max<std::size_t>(2, count / 2);
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
  const int fine = (resolution + kBlock - 1) / kBlock * kBlock;
  // First in a box around everything, larger where the hull touches it; then, finely, in the box that the hull fills.
  bool fits = false;
  for (int attempt = 0;; ++attempt) {
    const bool last = fits || attempt >= 5;
    const int n = last ? fine : (fine / kFirstShare + kBlock - 1) / kBlock * kBlock;
    hull.grid_ = {center - Eigen::Vector3d::Constant(half), 2 * half / n, n};
    hull.kept_ = vote(views, hull.grid_, tolerance, job);
    if (last) break;
    Eigen::Vector3i low = Eigen::Vector3i::Constant(n), high = Eigen::Vector3i::Constant(-1);
    for (int z = 0; z < n; ++z)
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          if (hull.kept_[(std::size_t(z) * std::size_t(n) + std::size_t(y)) * std::size_t(n) + std::size_t(x)]) {
            low = low.cwiseMin(Eigen::Vector3i(x, y, z));
            high = high.cwiseMax(Eigen::Vector3i(x, y, z));
          }
    if (high.x() < 0) return std::nullopt;
    const Eigen::Vector3i size = high - low + Eigen::Vector3i::Ones();
    if (low.minCoeff() == 0 || high.maxCoeff() == n - 1) {
      half *= 1.4;
      continue;
    }
    // A box that the hull fills but for a fifth is kept; else the next one is tight, to within the coarse voxels.
    fits = true;
    if (size.maxCoeff() * 10 >= n * 8) continue;
    center = hull.grid_.low + hull.grid_.voxel * 0.5 * (low + high + Eigen::Vector3i::Ones()).cast<double>();
    half = hull.grid_.voxel * (0.5 * size.maxCoeff() + 1.5);
    fits = size.maxCoeff() * 4 >= n;  // of a hull that was tiny in its box little is known yet
  }
  if (std::find(hull.kept_.begin(), hull.kept_.end(), 1) == hull.kept_.end()) return std::nullopt;
  hull.measure_depth();
  return hull;
}

void CoarseHull::measure_depth() {
  const std::size_t n = std::size_t(grid_.n), count = kept_.size();
  std::vector<std::uint8_t> rows(count), planes(count), inner = kept_;
  for (int depth = 1; depth < kDeepest; ++depth) {
    // Voxels whose 26 neighbours are all there: one axis after another. Rows are taken to follow each other: the hull
    // keeps away from the grid's border.
    const auto shrink = [&](const std::vector<std::uint8_t>& in, std::vector<std::uint8_t>& out, std::size_t step) {
      std::fill(out.begin(), out.end(), std::uint8_t(0));
      for (std::size_t i = step; i + step < count; ++i) out[i] = in[i - step] & in[i] & in[i + step];
    };
    shrink(inner, rows, 1);
    shrink(rows, planes, n);
    shrink(planes, inner, n * n);
    std::uint8_t any = 0;
    for (std::size_t i = 0; i < count; ++i) kept_[i] = std::uint8_t(kept_[i] + inner[i]), any |= inner[i];
    if (!any) break;
  }
}

double CoarseHull::voxel_px(const CoarseView& view) const {
  Matrix23d jacobian;
  if (!view.view.camera.project(view.view.cam_from_world * grid_.center(), &jacobian)) return 1;
  return grid_.voxel * jacobian.norm() / std::sqrt(2.0) / view.step;
}

int CoarseHull::margin_px(const CoarseView& view) const { return 3 + int(std::ceil(voxel_px(view))); }

template <class Visit>
void CoarseHull::visit_kept(const CoarseView& view, int least, Visit&& visit) const {
  const float width = float(view.mask.width()), height = float(view.mask.height());
  const Lattice lattice = project(view, grid_.low, grid_.voxel, grid_.n);
  for (int z = 0; z < grid_.n; ++z)
    for (int y = 0; y < grid_.n; ++y) {
      const std::uint8_t* kept =
          kept_.data() + (std::size_t(z) * std::size_t(grid_.n) + std::size_t(y)) * std::size_t(grid_.n);
      visit_row(
          lattice, y, z,
          [&](int block) {
            const std::uint8_t* k = kept + block * kBlock;
            return *std::max_element(k, k + kBlock) >= least;
          },
          [&](int x, float u, float v) {
            if (kept[x] >= least && u >= 0 && u < width && v >= 0 && v < height) visit(kept[x], u, v);
          });
    }
}

Image CoarseHull::silhouette(const CoarseView& view, int grow) const {
  Image out(view.mask.width(), view.mask.height(), 1);
  // A voxel covers a square as wide as its diagonal; overlapping squares leave no gaps.
  const int reach = int(std::ceil(0.5 * std::sqrt(3.0) * voxel_px(view))) + grow;
  visit_kept(view, 1, [&](std::uint8_t, float u, float v) { out.row<std::uint8_t>(int(v))[int(u)] = 255; });
  return grown(out, reach);
}

Image CoarseHull::depth(const CoarseView& view, int least) const {
  const int width = view.mask.width(), height = view.mask.height();
  // One cell of the picture for each voxel's width: every ray through the hull meets voxels' centres in its cell.
  const float cells_per_px = float(1 / std::max(1.0, voxel_px(view)));
  Image cells(int(float(width) * cells_per_px) + 1, int(float(height) * cells_per_px) + 1, 1);
  visit_kept(view, least, [&](std::uint8_t depth, float u, float v) {
    std::uint8_t& cell = cells.row<std::uint8_t>(int(v * cells_per_px))[int(u * cells_per_px)];
    cell = std::max(cell, depth);
  });
  Image out(width, height, 1);
  std::vector<int> column(static_cast<std::size_t>(width));
  for (int x = 0; x < width; ++x) column[std::size_t(x)] = int((float(x) + 0.5f) * cells_per_px);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* in = cells.row<std::uint8_t>(int((float(y) + 0.5f) * cells_per_px));
    std::uint8_t* to = out.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x) to[x] = in[column[std::size_t(x)]];
  }
  return out;
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
