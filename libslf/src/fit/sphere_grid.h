#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lumihull::slf {

/// Values for all directions on a grid of side x side nodes: the octahedron |x| + |y| + |z| = 1 unfolded into a square
/// (Praun & Hoppe 2003), z upwards in its middle, bilinear between nodes. The square's border is a seam: each of its
/// nodes is the same direction as another one, and stands for it.
class SphereGrid {
 public:
  struct Place {
    std::array<std::uint32_t, 4> node;
    std::array<float, 4> weight;
  };

  explicit SphereGrid(int side) : side_(side) {}  ///< >= 3

  std::size_t size() const { return std::size_t(side_) * std::size_t(side_); }
  int side() const { return side_; }

  /// The nodes around a direction (not zero), row by row.
  Place at(const Eigen::Vector3f& d) const {
    const float scale = 1 / (std::fabs(d.x()) + std::fabs(d.y()) + std::fabs(d.z()));
    float u = d.x() * scale, v = d.y() * scale;
    if (d.z() < 0) {
      const float folded = (1 - std::fabs(v)) * (u < 0 ? -1.0f : 1.0f);
      v = (1 - std::fabs(u)) * (v < 0 ? -1.0f : 1.0f);
      u = folded;
    }
    const float last = float(side_ - 1);
    const float x = std::clamp((0.5f + 0.5f * u) * last, 0.0f, last),
                y = std::clamp((0.5f + 0.5f * v) * last, 0.0f, last);
    const int x0 = std::min(int(x), side_ - 2), y0 = std::min(int(y), side_ - 2);
    const float fx = x - float(x0), fy = y - float(y0);
    const std::uint32_t i = std::uint32_t(y0 * side_ + x0), row = std::uint32_t(side_);
    return {{i, i + 1, i + row, i + row + 1}, {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
  }

  /// The node that stands for this one: itself, but on the border the first of those of one direction.
  std::uint32_t alias(std::uint32_t node) const {
    const int last = side_ - 1;
    int x = int(node) % side_, y = int(node) / side_;
    const bool on_x = x == 0 || x == last, on_y = y == 0 || y == last;
    if (on_x && on_y) return 0;
    if (on_x) y = std::min(y, last - y);
    if (on_y) x = std::min(x, last - x);
    return std::uint32_t(y * side_ + x);
  }

 private:
  int side_;
};

}  // namespace lumihull::slf
