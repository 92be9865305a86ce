#include "atlas.h"

#include <lumihull/base/error.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>
#include <string>
#include <tuple>
#include <unordered_map>

namespace lumihull::slf {
namespace {

constexpr float kMinCosine = 0.5f;  // of a triangle's normal to its chart's axis
constexpr float kSamePlace = 6;     // texels of the same chart that show places nearer than this are neighbours
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr int kBlock = 8;

struct ChartTexel {
  int x, y;
  float distance2;  // from the texel's centre to the projected triangle, texels²
  std::uint32_t triangle;
  float b1, b2;
  Eigen::Vector3f place;
};

struct Chart {
  Eigen::Vector3f origin, axis, right, down;
  std::vector<std::uint32_t> triangles;
  std::vector<ChartTexel> texels;
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // of the texels, inclusive
  int at_x = 0, at_y = 0;              // where the box's corner is in the texture
};

/// The triangle across each of the three edges (from corner i to corner i + 1), kNone at a border.
std::vector<std::array<std::uint32_t, 3>> neighbours_of(const hull::Mesh& mesh) {
  struct Edge {
    std::uint32_t low, high, triangle, side;
  };
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, i});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) < std::tie(b.low, b.high, b.triangle, b.side);
  });
  std::vector<std::array<std::uint32_t, 3>> neighbours(mesh.triangles.size(), {kNone, kNone, kNone});
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const Edge &a = edges[i], &b = edges[i + 1];
    if (a.low != b.low || a.high != b.high) continue;
    neighbours[a.triangle][a.side] = b.triangle;
    neighbours[b.triangle][b.side] = a.triangle;
    ++i;
  }
  return neighbours;
}

class Charter {
 public:
  Charter(const hull::Mesh& mesh, float texel_size, int max_extent)
      : mesh_(mesh),
        texel_(texel_size),
        max_extent_(max_extent),
        neighbours_(neighbours_of(mesh)),
        vertex_normals_(hull::vertex_normals(mesh)),
        chart_of_(mesh.triangles.size(), kNone) {
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const Eigen::Vector3f n = (b - a).cross(c - a);
      const float length = n.norm();
      normals_.push_back(length > 0 && std::isfinite(length) ? Eigen::Vector3f(n / length) : Eigen::Vector3f(0, 0, 0));
    }
  }

  /// All charts; fewer, where their texels are more than `most` already.
  std::vector<Chart> run(std::size_t most) {
    std::vector<Chart> charts;
    std::size_t texels = 0;
    for (std::uint32_t seed = 0; seed < mesh_.triangles.size() && texels <= most; ++seed)
      if (chart_of_[seed] == kNone && !normals_[seed].isZero()) {
        charts.push_back(grow(seed, std::uint32_t(charts.size())));
        texels += charts.back().texels.size();
      }
    return charts;
  }

  std::array<Eigen::Vector2f, 3> project(const Chart& chart, std::uint32_t triangle) const {
    std::array<Eigen::Vector2f, 3> p;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3f v = mesh_.vertices[mesh_.triangles[triangle][i]] - chart.origin;
      p[i] = {v.dot(chart.right) / texel_, v.dot(chart.down) / texel_};
    }
    return p;
  }

 private:
  Chart grow(std::uint32_t seed, std::uint32_t id) {
    Chart chart;
    // The mean direction around the seed: single triangles of a voxel surface are noisy.
    Eigen::Vector3f axis = normals_[seed];
    for (const std::uint32_t v : mesh_.triangles[seed]) axis += vertex_normals_[v];
    axis.normalize();
    chart.axis = axis.dot(normals_[seed]) > kMinCosine ? axis : normals_[seed];
    const Eigen::Vector3f helper =
        std::abs(chart.axis.z()) < 0.9f ? Eigen::Vector3f(0, 0, 1) : Eigen::Vector3f(1, 0, 0);
    chart.right = helper.cross(chart.axis).normalized();
    chart.down = chart.right.cross(chart.axis);  // seen from outside: right, down, into the surface
    chart.origin = mesh_.vertices[mesh_.triangles[seed][0]];
    owner_.clear();

    struct Front {
      float cosine;
      std::uint32_t triangle;
      bool operator<(const Front& o) const { return cosine != o.cosine ? cosine < o.cosine : triangle > o.triangle; }
    };
    std::priority_queue<Front> front;
    front.push({1, seed});
    bool first = true;
    while (!front.empty()) {
      const std::uint32_t t = front.top().triangle;
      front.pop();
      if (chart_of_[t] != kNone || !add(chart, t, first)) continue;
      chart_of_[t] = id;
      first = false;
      for (const std::uint32_t n : neighbours_[t]) {
        if (n == kNone || chart_of_[n] != kNone || normals_[n].isZero()) continue;
        const float cosine = normals_[n].dot(chart.axis);
        if (cosine > kMinCosine) front.push({cosine, n});
      }
    }
    return chart;
  }

  /// Claims the texels of a triangle; false, and nothing claimed, where one of them shows another place already.
  bool add(Chart& chart, std::uint32_t triangle, bool must) {
    const auto p = project(chart, triangle);
    const int x0 = int(std::ceil(std::min({p[0].x(), p[1].x(), p[2].x()}) - kTexelReach - 0.5f));
    const int x1 = int(std::floor(std::max({p[0].x(), p[1].x(), p[2].x()}) + kTexelReach - 0.5f));
    const int y0 = int(std::ceil(std::min({p[0].y(), p[1].y(), p[2].y()}) - kTexelReach - 0.5f));
    const int y1 = int(std::floor(std::max({p[0].y(), p[1].y(), p[2].y()}) + kTexelReach - 0.5f));
    const bool empty = chart.triangles.empty();
    const int bx0 = empty ? x0 : std::min(x0, chart.x0), bx1 = empty ? x1 : std::max(x1, chart.x1);
    const int by0 = empty ? y0 : std::min(y0, chart.y0), by1 = empty ? y1 : std::max(y1, chart.y1);
    if (!must && (bx1 - bx0 >= max_extent_ || by1 - by0 >= max_extent_)) return false;

    const auto& corners = mesh_.triangles[triangle];
    const Eigen::Vector3f a = mesh_.vertices[corners[0]], e1 = mesh_.vertices[corners[1]] - a,
                          e2 = mesh_.vertices[corners[2]] - a;
    claims_.clear();
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const NearestPlace n = nearest_in_triangle(p, {float(x) + 0.5f, float(y) + 0.5f});
        if (n.distance2 > kTexelReach * kTexelReach) continue;
        const Eigen::Vector3f place = a + n.b1 * e1 + n.b2 * e2;
        const auto old = owner_.find(key(x, y));
        if (old != owner_.end() &&
            (chart.texels[old->second].place - place).squaredNorm() > kSamePlace * kSamePlace * texel_ * texel_)
          return false;
        claims_.push_back({x, y, n.distance2, triangle, n.b1, n.b2, place});
      }
    for (const ChartTexel& claim : claims_) {
      const auto [it, inserted] = owner_.try_emplace(key(claim.x, claim.y), std::uint32_t(chart.texels.size()));
      if (inserted)
        chart.texels.push_back(claim);
      else if (claim.distance2 < chart.texels[it->second].distance2)
        chart.texels[it->second] = claim;
    }
    chart.triangles.push_back(triangle);
    chart.x0 = bx0, chart.x1 = bx1, chart.y0 = by0, chart.y1 = by1;
    return true;
  }

  static std::uint64_t key(int x, int y) { return (std::uint64_t(std::uint32_t(x)) << 32) | std::uint32_t(y); }

  const hull::Mesh& mesh_;
  float texel_;
  int max_extent_;
  std::vector<std::array<std::uint32_t, 3>> neighbours_;
  std::vector<Eigen::Vector3f> vertex_normals_, normals_;
  std::vector<std::uint32_t> chart_of_;
  std::unordered_map<std::uint64_t, std::uint32_t> owner_;
  std::vector<ChartTexel> claims_;
};

/// No texel can be smaller than this: projected along a chart's axis, areas and lengths shrink to cos 60° at most, and
/// all areas together and each edge must fit. Memory follows the texture, whatever the photographs resolve.
double least_texel(const hull::Mesh& mesh, int max_side) {
  double area = 0, longest = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    area += 0.5 * (b - a).cross(c - a).norm();
    longest = std::max({longest, (b - a).norm(), (c - b).norm(), (a - c).norm()});
  }
  // An edge may lie along the diagonal of its box.
  return std::max(std::sqrt(kMinCosine * area), kMinCosine / std::sqrt(2.0) * longest) / max_side;
}

/// Rows of falling height, `width` wide; the height that they need.
int pack(std::vector<Chart>& charts, int width) {
  std::vector<std::size_t> order(charts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto h = [&](std::size_t i) { return charts[i].y1 - charts[i].y0 + 1; };
  const auto w = [&](std::size_t i) { return charts[i].x1 - charts[i].x0 + 1; };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::tuple(-h(a), -w(a), a) < std::tuple(-h(b), -w(b), b); });
  int x = 0, y = 0, row = 0;
  for (const std::size_t i : order) {
    if (x + w(i) > width) y += row, x = 0, row = 0;
    row = std::max(row, h(i));
    charts[i].at_x = x, charts[i].at_y = y;
    x += w(i);
  }
  return y + row;
}

}  // namespace

NearestPlace nearest_in_triangle(const std::array<Eigen::Vector2f, 3>& t, const Eigen::Vector2f& p) {
  const Eigen::Vector2f e1 = t[1] - t[0], e2 = t[2] - t[0], d = p - t[0];
  const float area = e1.x() * e2.y() - e1.y() * e2.x();
  if (area != 0) {
    const float b1 = (d.x() * e2.y() - d.y() * e2.x()) / area, b2 = (e1.x() * d.y() - e1.y() * d.x()) / area;
    if (b1 >= 0 && b2 >= 0 && b1 + b2 <= 1) return {0, b1, b2};
  }
  NearestPlace best{std::numeric_limits<float>::infinity(), 0, 0};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector2f &a = t[i], e = t[(i + 1) % 3] - a;
    const float length2 = e.squaredNorm();
    const float s = length2 > 0 ? std::clamp((p - a).dot(e) / length2, 0.0f, 1.0f) : 0.0f;
    const float distance2 = (a + s * e - p).squaredNorm();
    if (distance2 >= best.distance2) continue;
    std::array<float, 3> b{};
    b[i] = 1 - s, b[(i + 1) % 3] = s;
    best = {distance2, b[1], b[2]};
  }
  return best;
}

Atlas make_atlas(const hull::Mesh& mesh, double texel_size, int max_side) {
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  // An object smaller than a pixel still gets some texels.
  texel_size = std::min(std::max(texel_size, least_texel(mesh, max_side)), 0.125 * double(box.diagonal().norm()));
  const std::size_t most = std::size_t(max_side) * std::size_t(max_side);
  for (;; texel_size *= 1.15) {
    if (texel_size > box.diagonal().norm())
      throw Error(ErrorCode::invalid_argument, "the mesh of " + std::to_string(mesh.triangles.size()) +
                                                   " triangles does not fit into a texture of " +
                                                   std::to_string(max_side) + " x " + std::to_string(max_side) +
                                                   ": allow a larger one or simplify");
    Charter charter(mesh, float(texel_size), max_side);
    std::vector<Chart> charts = charter.run(most);
    double area = 0;
    int widest = 4;
    for (const Chart& c : charts) {
      area += double(c.x1 - c.x0 + 1) * (c.y1 - c.y0 + 1);
      widest = std::max({widest, c.x1 - c.x0 + 1, c.y1 - c.y0 + 1});
    }
    if (widest > max_side || area > double(max_side) * max_side) continue;
    int width = std::clamp(int(std::sqrt(area * 1.05)) + 3, widest, max_side) / 4 * 4;
    if (width < widest) width = max_side;
    int height = pack(charts, width);
    if (height > max_side) height = pack(charts, width = max_side);
    if (height > max_side) continue;

    Atlas atlas;
    atlas.width = width, atlas.height = std::max(4, (height + 3) / 4 * 4);
    if (atlas.height > max_side) atlas.height = height;
    atlas.texel_size = texel_size;
    atlas.charts = charts.size();
    atlas.uv.assign(mesh.triangles.size(),
                    {Eigen::Vector2f(0.5f, 0.5f), Eigen::Vector2f(0.5f, 0.5f), Eigen::Vector2f(0.5f, 0.5f)});
    for (Chart& chart : charts) {
      const Eigen::Vector2f shift(float(chart.at_x - chart.x0), float(chart.at_y - chart.y0));
      for (const std::uint32_t t : chart.triangles) {
        auto p = charter.project(chart, t);
        for (auto& corner : p) corner += shift;
        atlas.uv[t] = p;
      }
      const auto block = [&](const ChartTexel& t) {
        return std::pair((t.y - chart.y0) / kBlock, (t.x - chart.x0) / kBlock);
      };
      std::sort(chart.texels.begin(), chart.texels.end(), [&](const ChartTexel& a, const ChartTexel& b) {
        return std::tuple(block(a), a.y, a.x) < std::tuple(block(b), b.y, b.x);
      });
      for (std::size_t k = 0; k < chart.texels.size(); ++k) {
        const ChartTexel& t = chart.texels[k];
        if (k == 0 || block(t) != block(chart.texels[k - 1]))
          atlas.blocks.push_back(std::uint32_t(atlas.texels.size()));
        atlas.texels.push_back({std::uint16_t(t.x - chart.x0 + chart.at_x), std::uint16_t(t.y - chart.y0 + chart.at_y),
                                t.triangle, t.b1, t.b2});
      }
    }
    atlas.blocks.push_back(std::uint32_t(atlas.texels.size()));
    return atlas;
  }
}

}  // namespace lumihull::slf
