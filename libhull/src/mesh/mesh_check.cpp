#include <lumihull/hull/mesh_check.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

#include "self_intersections.h"

namespace lumihull::hull {
namespace {

struct Halfedge {
  std::uint32_t low, high;  // vertices, low < high
  std::uint32_t triangle;
  bool forward;  // from low to high

  bool operator<(const Halfedge& o) const {
    return std::tie(low, high, forward, triangle) < std::tie(o.low, o.high, o.forward, o.triangle);
  }
};

std::uint32_t find(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

MeshCheck check_mesh(const Mesh& mesh, bool self_intersections) {
  validate(mesh, "mesh");
  MeshCheck check;
  std::vector<Halfedge> halfedges;
  halfedges.reserve(3 * mesh.triangles.size());
  std::vector<std::uint8_t> used(mesh.vertices.size());
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    const Eigen::Vector3d a = mesh.vertices[v[0]].cast<double>(), b = mesh.vertices[v[1]].cast<double>(),
                          c = mesh.vertices[v[2]].cast<double>();
    check.degenerate_triangles += (b - a).cross(c - a).squaredNorm() == 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t p = v[i], q = v[(i + 1) % 3];
      used[p] = 1;
      parent[find(parent, p)] = find(parent, q);
      if (p != q) halfedges.push_back({std::min(p, q), std::max(p, q), t, p < q});
    }
  }
  std::sort(halfedges.begin(), halfedges.end());

  // Two triangles at every edge, of opposite directions. Around a vertex, its corners are joined across such edges;
  // one fan a vertex means that nothing else hangs on it.
  check.closed = check.oriented = !mesh.empty() && halfedges.size() == 3 * mesh.triangles.size();
  std::size_t edges = 0;
  std::vector<std::uint32_t> fan(3 * mesh.triangles.size());  // by corner
  std::iota(fan.begin(), fan.end(), 0u);
  const auto corner = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const auto& v = mesh.triangles[triangle];
    return 3 * triangle + (v[0] == vertex ? 0u : v[1] == vertex ? 1u : 2u);
  };
  for (std::size_t first = 0, last = 0; first < halfedges.size(); first = last) {
    while (last < halfedges.size() && halfedges[last].low == halfedges[first].low &&
           halfedges[last].high == halfedges[first].high)
      ++last;
    ++edges;
    if (last - first != 2) {
      check.closed = check.oriented = false;
      continue;
    }
    const Halfedge &a = halfedges[first], &b = halfedges[first + 1];
    if (a.forward == b.forward) check.oriented = false;
    for (const std::uint32_t vertex : {a.low, a.high})
      fan[find(fan, corner(a.triangle, vertex))] = find(fan, corner(b.triangle, vertex));
  }
  std::size_t used_vertices = 0, fans = 0;
  for (std::uint32_t v = 0; v < used.size(); ++v) {
    used_vertices += used[v];
    check.parts += used[v] && find(parent, v) == v;
  }
  for (std::uint32_t c = 0; c < fan.size(); ++c) fans += find(fan, c) == c;
  check.unused_vertices = used.size() - used_vertices;
  check.manifold = check.closed && fans == used_vertices;
  check.euler = std::ptrdiff_t(used_vertices) - std::ptrdiff_t(edges) + std::ptrdiff_t(mesh.triangles.size());
  check.volume = enclosed_volume(mesh);
  if (self_intersections && check.manifold && check.oriented) check.self_intersections = count_self_intersections(mesh);
  return check;
}

}  // namespace lumihull::hull
