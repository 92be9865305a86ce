#include <lumihull/hull/carve.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace lumihull::hull {
namespace {

std::uint32_t find(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

std::size_t remove_specks(Mesh& mesh, double min_share) {
  if (mesh.empty()) return 0;
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const auto& t : mesh.triangles)
    for (int i = 1; i < 3; ++i) {
      const std::uint32_t a = find(parent, t[0]), b = find(parent, t[std::size_t(i)]);
      // The lowest vertex stands for its part: the same whatever the order.
      if (a != b) parent[std::max(a, b)] = std::min(a, b);
    }
  std::vector<double> volume(mesh.vertices.size());
  const Eigen::Vector3d origin = mesh.vertices[0].cast<double>();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>() - origin;
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>() - origin;
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>() - origin;
    volume[find(parent, t[0])] += a.dot(b.cross(c));
  }
  double largest = 0;
  for (const double v : volume) largest = std::max(largest, std::abs(v));
  std::size_t removed = 0;
  std::vector<std::uint8_t> keep(mesh.vertices.size());
  for (std::uint32_t v = 0; v < parent.size(); ++v) {
    const std::uint32_t root = find(parent, v);
    keep[v] = std::abs(volume[root]) >= min_share * largest;
    removed += root == v && !keep[v];
  }
  if (removed == 0) return 0;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size());
  std::uint32_t n = 0;
  for (std::uint32_t v = 0; v < keep.size(); ++v) {
    renumbered[v] = n;
    if (keep[v]) mesh.vertices[n++] = mesh.vertices[v];
  }
  mesh.vertices.resize(n);
  std::erase_if(mesh.triangles, [&](const auto& t) { return !keep[t[0]]; });
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t) v = renumbered[v];
  return removed;
}

}  // namespace lumihull::hull
