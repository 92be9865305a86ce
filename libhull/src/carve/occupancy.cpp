#include "occupancy.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "block_kernel.h"

namespace lumihull::hull {
namespace {

class Splitter {
 public:
  Splitter(const HullFunction::Impl& function, const Box& box, int size, std::vector<std::uint32_t>& seen)
      : function_(function), box_(box), size_(size), seen_(seen) {}

  struct Cell {
    int x, y, z, size, deep_outside, seen;
  };

  /// Marks how many views see each cell whole that may be object.
  void split(Cell cell, std::span<const std::uint32_t> list) const {
    const Eigen::Vector3d unit = box_.size() / size_;
    const Eigen::Vector3d half = 0.5 * cell.size * unit;
    const Eigen::Vector3d center = box_.min + Eigen::Vector3d(cell.x, cell.y, cell.z).cwiseProduct(unit) + half;
    for (const CutPlane& p : function_.rule.cut_planes)
      if (p.normal.dot(center) - p.offset > p.normal.cwiseAbs().dot(half)) return;
    for (const Box& b : function_.rule.cut_boxes)
      if (cut_by(b, center) > half.norm()) return;
    std::vector<std::uint32_t> kept;
    int whole = 0;
    for (const std::uint32_t i : list) {
      const std::uint8_t bits = bound(function_.views[i], center, half);
      if (bits == kNotSeen) continue;
      if (bits == kDeepInside) {
        ++cell.seen;
      } else if (bits == kDeepOutside) {
        ++cell.seen;
        if (++cell.deep_outside >= function_.rule.tolerance) return;
      } else {
        kept.push_back(i);
        whole += bits != 0 && !(bits & kNotSeen);
      }
    }
    if (cell.seen + int(kept.size()) < function_.min_views) return;
    if (cell.size == 1) {
      // Within the band the distance itself tells. From the middle to anywhere in the cell the field's slope (at most
      // sqrt 2, interpolated) and the obliquity of rays up to 45 degrees off the axis change φ by less than twice the
      // way.
      for (const std::uint32_t i : kept)
        if (function_.views[i].phi(center) > 2 * half.norm() && ++cell.deep_outside >= function_.rule.tolerance) return;
      seen_[(std::size_t(cell.z) * size_ + cell.y) * size_ + cell.x] = std::uint32_t(1 + cell.seen + whole);
      return;
    }
    const int h = cell.size / 2;
    for (int child = 0; child < 8; ++child)
      split({cell.x + (child & 1) * h, cell.y + (child >> 1 & 1) * h, cell.z + (child >> 2) * h, h, cell.deep_outside,
             cell.seen},
            kept);
  }

 private:
  const HullFunction::Impl& function_;
  const Box box_;
  const int size_;
  std::vector<std::uint32_t>& seen_;
};

}  // namespace

Occupancy occupancy(const HullFunction::Impl& function, const Box& box, int size, double share, Job& job) {
  Occupancy cells{box, size, {}};
  std::vector<std::uint32_t> seen(std::size_t(size) * size * size);
  const Splitter splitter(function, box, size, seen);
  std::vector<std::uint32_t> all(function.views.size());
  std::iota(all.begin(), all.end(), 0u);
  // Sixty-four chunks, each a cell of its own.
  const int n = std::min(size, 4), step = size / n;
  parallel_for(job, std::size_t(n) * n * n, [&](std::size_t i) {
    splitter.split({int(i) % n * step, int(i) / n % n * step, int(i) / (n * n) * step, step, 0, 0}, all);
  });
  const std::uint32_t best = *std::max_element(seen.begin(), seen.end());
  // What one view alone sees goes on without end.
  const std::uint32_t most = best > 0 ? best - 1 : 0;
  const std::uint32_t least = std::max(std::uint32_t(std::ceil(share * most)), std::min(most, 2u));
  cells.occupied.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) cells.occupied[i] = seen[i] > 0 && seen[i] - 1 >= least;
  return cells;
}

void remove_specks(Occupancy& cells, double min_share) {
  std::vector<std::uint32_t> label(cells.occupied.size());
  std::vector<std::size_t> sizes{0};
  std::vector<std::size_t> stack;
  const int n = cells.size;
  for (std::size_t start = 0; start < label.size(); ++start) {
    if (!cells.occupied[start] || label[start]) continue;
    const auto id = std::uint32_t(sizes.size());
    sizes.push_back(0);
    label[start] = id;
    stack.push_back(start);
    while (!stack.empty()) {
      const std::size_t at = stack.back();
      stack.pop_back();
      ++sizes[id];
      const int x = int(at % n), y = int(at / n % n), z = int(at / n / n);
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int a = x + dx, b = y + dy, c = z + dz;
            if (a < 0 || b < 0 || c < 0 || a >= n || b >= n || c >= n) continue;
            const std::size_t next = cells.index(a, b, c);
            if (!cells.occupied[next] || label[next]) continue;
            label[next] = id;
            stack.push_back(next);
          }
    }
  }
  const double largest = double(*std::max_element(sizes.begin(), sizes.end()));
  for (std::size_t i = 0; i < label.size(); ++i)
    if (double(sizes[label[i]]) < min_share * largest) cells.occupied[i] = 0;
}

bool extent(const Occupancy& cells, std::array<int, 3>& first, std::array<int, 3>& last) {
  first.fill(cells.size);
  last.fill(-1);
  for (int z = 0; z < cells.size; ++z)
    for (int y = 0; y < cells.size; ++y)
      for (int x = 0; x < cells.size; ++x) {
        if (!cells.occupied[cells.index(x, y, z)]) continue;
        const int at[3] = {x, y, z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          first[axis] = std::min(first[axis], at[axis]);
          last[axis] = std::max(last[axis], at[axis]);
        }
      }
  return last[0] >= 0;
}

}  // namespace lumihull::hull
