#include "outline.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace lumihull::slf {
namespace {

constexpr double kPadPx = 0.05;   // rays are computed in float
constexpr double kPiecePx = 4;    // an edge is straight over that length, whatever the lens
constexpr double kEdgeOn = 1e-6;  // rad: triangles that are seen flatter count as edges
constexpr int kMostHalvings = 16;

class Marker {
 public:
  Marker(const View& view, std::vector<std::uint8_t>& marks) : camera_(view.camera), marks_(marks) {}

  /// Marks where the segment between two points of the camera's frame is seen.
  bool segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const auto pa = camera_.project(a), pb = camera_.project(b);
    if (!pa || !pb) return false;
    if (camera_.has_distortion()) return bent(a, b, *pa, *pb, 0);
    straight(*pa, *pb);
    return true;
  }

 private:
  bool bent(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector2d& pa, const Eigen::Vector2d& pb,
            int halvings) {
    if ((pa - pb).squaredNorm() <= kPiecePx * kPiecePx || halvings == kMostHalvings) {
      straight(pa, pb);
      return true;
    }
    const Eigen::Vector3d middle = 0.5 * (a + b);
    const auto pm = camera_.project(middle);
    return pm && bent(a, middle, pa, *pm, halvings + 1) && bent(middle, b, *pm, pb, halvings + 1);
  }

  /// Every pixel that the segment comes within kPadPx of: a run in each column, or in each row where it is steep.
  void straight(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const int along = std::abs(a.x() - b.x()) >= std::abs(a.y() - b.y()) ? 0 : 1, across = 1 - along;
    const std::array<int, 2> size{camera_.width, camera_.height};
    Eigen::Vector2d low = a, high = b;
    if (low[along] > high[along]) std::swap(low, high);
    if (!(high[along] + kPadPx >= 0 && low[along] - kPadPx <= size[along])) return;
    const double length = high[along] - low[along];
    const double slope = length > 0 ? (high[across] - low[across]) / length : 0;
    const int first = int(std::max(0.0, std::floor(low[along] - kPadPx)));
    const int last = int(std::min(size[along] - 1.0, std::floor(high[along] + kPadPx)));
    for (int i = first; i <= last; ++i) {
      const double from = std::clamp(i - kPadPx, low[along], high[along]),
                   to = std::clamp(i + 1 + kPadPx, low[along], high[along]);
      double p = low[across] + slope * (from - low[along]), q = low[across] + slope * (to - low[along]);
      if (p > q) std::swap(p, q);
      if (!(q + kPadPx >= 0 && p - kPadPx <= size[across])) continue;
      const int begin = int(std::max(0.0, std::floor(p - kPadPx)));
      const int end = int(std::min(size[across] - 1.0, std::floor(q + kPadPx)));
      for (int j = begin; j <= end; ++j)
        marks_[along == 0 ? std::size_t(j) * std::size_t(size[0]) + std::size_t(i)
                          : std::size_t(i) * std::size_t(size[0]) + std::size_t(j)] = 1;
    }
  }

  const Camera& camera_;
  std::vector<std::uint8_t>& marks_;
};

}  // namespace

std::vector<MeshEdge> mesh_edges(const hull::Mesh& mesh) {
  // Sides of triangles, by their lower end.
  struct Side {
    std::uint32_t high, opposite;
  };
  std::vector<std::uint32_t> start(mesh.vertices.size() + 1, 0);
  const auto each_side = [&](const auto& visit) {
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[std::size_t(k)], b = t[std::size_t(k + 1) % 3], c = t[std::size_t(k + 2) % 3];
        visit(std::min(a, b), std::max(a, b), c);
      }
  };
  each_side([&](std::uint32_t low, std::uint32_t, std::uint32_t) { ++start[low + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  std::vector<Side> sides(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
  each_side([&](std::uint32_t low, std::uint32_t high, std::uint32_t c) { sides[next[low]++] = {high, c}; });

  std::vector<MeshEdge> edges;
  edges.reserve(sides.size() / 2);
  for (std::uint32_t v = 0; v + 1 < start.size(); ++v) {
    const auto begin = sides.begin() + start[v], end = sides.begin() + start[v + 1];
    std::sort(begin, end, [](const Side& a, const Side& b) {
      return a.high != b.high ? a.high < b.high : a.opposite < b.opposite;
    });
    for (auto side = begin; side != end;) {
      auto last = side;
      while (last != end && last->high == side->high) ++last;
      if (last - side != 2) edges.push_back({{v, side->high}, {side->opposite, kNoCorner}});
      for (auto s = side; s + 1 < last; ++s) edges.push_back({{v, s->high}, {s->opposite, (s + 1)->opposite}});
      side = last;
    }
  }
  return edges;
}

bool mark_outlines(const View& view, const hull::Mesh& mesh, const std::vector<MeshEdge>& edges,
                   std::vector<std::uint8_t>& marks) {
  marks.assign(std::size_t(view.camera.width) * std::size_t(view.camera.height), 0);
  // The eye as the rays have it.
  const Eigen::Vector3d eye = view.center().cast<float>().cast<double>();
  std::vector<Eigen::Vector3d> ways;
  ways.reserve(mesh.vertices.size());
  for (const auto& v : mesh.vertices) ways.push_back(v.cast<double>() - eye);
  const Eigen::Matrix3d cam_from_world = view.cam_from_world.rotation.toRotationMatrix();
  Marker marker(view, marks);
  for (const MeshEdge& e : edges) {
    const Eigen::Vector3d &a = ways[e.ends[0]], &b = ways[e.ends[1]];
    if (e.opposite[1] != kNoCorner) {
      // On which sides of the plane through the eye and the edge the triangles lie.
      const Eigen::Vector3d plane = a.cross(b);
      const Eigen::Vector3d &c = ways[e.opposite[0]], &d = ways[e.opposite[1]];
      const double at_c = plane.dot(c), at_d = plane.dot(d);
      const double least2 = kEdgeOn * kEdgeOn * plane.squaredNorm();
      const bool clear = at_c * at_c > least2 * c.squaredNorm() && at_d * at_d > least2 * d.squaredNorm();
      if (clear && (at_c > 0) != (at_d > 0)) continue;
    }
    if (!marker.segment(cam_from_world * a, cam_from_world * b)) return false;
  }
  return true;
}

}  // namespace lumihull::slf
