#include "marching_cubes_table.h"

#include <cassert>
#include <limits>
#include <vector>

namespace lumihull::hull {
namespace {

struct Face {
  std::array<int, 4> corners;  // counter-clockwise seen from outside the cube
};

std::array<Face, 6> make_faces() {
  std::array<Face, 6> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, w = 1 << axis;
    faces[std::size_t(2 * axis)].corners = {0, v, u | v, u};  // the low side looks along -axis
    faces[std::size_t(2 * axis + 1)].corners = {w, w | u, w | u | v, w | v};
  }
  return faces;
}

std::array<CubeEdge, 12> make_edges() {
  std::array<CubeEdge, 12> edges;
  std::size_t n = 0;
  for (std::uint8_t axis = 0; axis < 3; ++axis)
    for (std::uint8_t corner = 0; corner < 8; ++corner)
      if (!(corner >> axis & 1)) edges[n++] = {corner, axis};
  return edges;
}

int edge_between(const std::array<CubeEdge, 12>& edges, int a, int b) {
  for (int e = 0; e < 12; ++e) {
    const int low = edges[std::size_t(e)].corner, high = low | 1 << edges[std::size_t(e)].axis;
    if ((low == a && high == b) || (low == b && high == a)) return e;
  }
  return -1;
}

/// Whether two edges lie on one face of the cube: then they share a coordinate besides their own directions.
bool on_one_face(const CubeEdge& a, const CubeEdge& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.axis != axis && b.axis != axis && (a.corner >> axis & 1) == (b.corner >> axis & 1)) return true;
  return false;
}

std::array<double, 3> midpoint(const CubeEdge& e) {
  std::array<double, 3> p{double(e.corner & 1), double(e.corner >> 1 & 1), double(e.corner >> 2)};
  p[e.axis] = 0.5;
  return p;
}

/// The triangulation of a polygon with the shortest admissible diagonals (sum of squares, vertices at the edges'
/// middles), by dynamic programming over intervals.
void triangulate(const std::array<CubeEdge, 12>& edges, const std::vector<int>& polygon, CubeCase& out) {
  const std::size_t n = polygon.size();
  constexpr double kForbidden = 1e9;
  const auto diagonal = [&](std::size_t i, std::size_t j) {
    if (j == i + 1 || (i == 0 && j == n - 1)) return 0.0;
    const CubeEdge &a = edges[std::size_t(polygon[i])], &b = edges[std::size_t(polygon[j])];
    if (on_one_face(a, b)) return kForbidden;
    const auto p = midpoint(a), q = midpoint(b);
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += (p[k] - q[k]) * (p[k] - q[k]);
    return sum;
  };
  std::vector<std::vector<double>> cost(n, std::vector<double>(n, 0));
  std::vector<std::vector<std::size_t>> apex(n, std::vector<std::size_t>(n, 0));
  for (std::size_t length = 2; length < n; ++length)
    for (std::size_t i = 0; i + length < n; ++i) {
      const std::size_t j = i + length;
      cost[i][j] = std::numeric_limits<double>::infinity();
      for (std::size_t k = i + 1; k < j; ++k) {
        const double c = cost[i][k] + cost[k][j] + diagonal(i, j);
        if (c < cost[i][j]) cost[i][j] = c, apex[i][j] = k;
      }
    }
  assert(cost[0][n - 1] < kForbidden);
  std::vector<std::pair<std::size_t, std::size_t>> stack{{0, n - 1}};
  while (!stack.empty()) {
    const auto [i, j] = stack.back();
    stack.pop_back();
    if (j - i < 2) continue;
    const std::size_t k = apex[i][j];
    out.edges[out.triangles++] = {std::uint8_t(polygon[i]), std::uint8_t(polygon[k]), std::uint8_t(polygon[j])};
    stack.push_back({i, k});
    stack.push_back({k, j});
  }
}

CubeTable make_table() {
  CubeTable table;
  table.edges = make_edges();
  const std::array<Face, 6> faces = make_faces();
  for (int bits = 0; bits < 256; ++bits) {
    // Each crossed edge's successor in its polygon.
    std::array<int, 12> next;
    next.fill(-1);
    for (const Face& face : faces) {
      const auto inside = [&](int i) { return (bits >> face.corners[std::size_t(i % 4)] & 1) != 0; };
      const auto edge = [&](int i) {
        return edge_between(table.edges, face.corners[std::size_t(i % 4)], face.corners[std::size_t((i + 1) % 4)]);
      };
      for (int i = 0; i < 4; ++i) {
        if (inside(i) || !inside(i + 1)) continue;
        int j = i + 1;  // the run of inside corners that begins here ends at the next crossing
        while (inside(j + 1)) ++j;
        next[std::size_t(edge(i))] = edge(j);
      }
    }
    std::array<bool, 12> used{};
    for (int e = 0; e < 12; ++e) {
      if (next[std::size_t(e)] < 0 || used[std::size_t(e)]) continue;
      std::vector<int> polygon;
      for (int at = e; !used[std::size_t(at)]; at = next[std::size_t(at)]) {
        used[std::size_t(at)] = true;
        polygon.push_back(at);
      }
      triangulate(table.edges, polygon, table.cases[std::size_t(bits)]);
    }
  }
  return table;
}

}  // namespace

const CubeTable& cube_table() {
  static const CubeTable table = make_table();
  return table;
}

}  // namespace lumihull::hull
