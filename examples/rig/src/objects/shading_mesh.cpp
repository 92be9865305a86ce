#include "shading_mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;
using Triangle = std::array<std::uint32_t, 3>;

ShadingMesh with_creases(const Object& object) {
  const hull::Mesh& in = object.mesh;
  ShadingMesh out;
  out.uv = object.uv;
  if (object.normals.size() == in.vertices.size()) {
    out.mesh = in;
    out.normals = object.normals;
    return out;
  }
  std::vector<Vector3f> faces;  // normal times twice the area
  std::vector<std::vector<std::uint32_t>> around(in.vertices.size());
  for (std::size_t t = 0; t < in.triangles.size(); ++t) {
    const auto& [a, b, c] = in.triangles[t];
    faces.push_back((in.vertices[b] - in.vertices[a]).cross(in.vertices[c] - in.vertices[a]));
    for (const std::uint32_t v : in.triangles[t]) around[v].push_back(std::uint32_t(t));
  }
  const float threshold = std::cos(.61f);  // 35°
  // Vertices made so far from each old one; few, so a list is searched.
  std::vector<std::vector<std::uint32_t>> copies(in.vertices.size());
  for (std::size_t t = 0; t < in.triangles.size(); ++t) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = in.triangles[t][std::size_t(k)];
      Vector3f sum = faces[t];
      for (const std::uint32_t other : around[v])
        if (other != t && faces[other].dot(faces[t]) > threshold * faces[other].norm() * faces[t].norm())
          sum += faces[other];
      const float length = sum.norm();
      const Vector3f normal = length > 0 ? Vector3f(sum / length) : Vector3f(0, 0, 1);
      std::uint32_t found = std::uint32_t(out.mesh.vertices.size());
      for (const std::uint32_t copy : copies[v])
        if (out.normals[copy].dot(normal) > .9999f) found = copy;
      if (found == out.mesh.vertices.size()) {
        out.mesh.vertices.push_back(in.vertices[v]);
        out.normals.push_back(normal);
        copies[v].push_back(found);
      }
      triangle[std::size_t(k)] = found;
    }
    out.mesh.triangles.push_back(triangle);
  }
  return out;
}

double mean_square_edge(const hull::Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    sum += (mesh.vertices[a] - mesh.vertices[b]).squaredNorm() + (mesh.vertices[b] - mesh.vertices[c]).squaredNorm() +
           (mesh.vertices[c] - mesh.vertices[a]).squaredNorm();
  return sum / (3 * double(mesh.triangles.size()));
}

void split_in_four(ShadingMesh& s) {
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
    const auto [it, added] = middles.try_emplace(key, std::uint32_t(s.mesh.vertices.size()));
    if (added) {
      s.mesh.vertices.push_back((s.mesh.vertices[a] + s.mesh.vertices[b]) / 2);
      s.normals.push_back((s.normals[a] + s.normals[b]).normalized());
    }
    return it->second;
  };
  std::vector<Triangle> triangles;
  std::vector<std::array<Eigen::Vector2f, 3>> uv;
  triangles.reserve(4 * s.mesh.triangles.size());
  for (std::size_t t = 0; t < s.mesh.triangles.size(); ++t) {
    const auto [a, b, c] = s.mesh.triangles[t];
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    triangles.insert(triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    if (!s.uv.empty()) {
      const auto& [p, q, r] = s.uv[t];
      const Eigen::Vector2f pq = (p + q) / 2, qr = (q + r) / 2, rp = (r + p) / 2;
      uv.insert(uv.end(), {{p, pq, rp}, {pq, q, qr}, {rp, qr, r}, {pq, qr, rp}});
    }
  }
  s.mesh.triangles = std::move(triangles);
  s.uv = std::move(uv);
}

}  // namespace

ShadingMesh shading_mesh(const Object& object, float spacing) {
  ShadingMesh result = with_creases(object);
  while (result.mesh.triangles.size() <= 500'000 && mean_square_edge(result.mesh) > double(spacing) * spacing)
    split_in_four(result);
  return result;
}

}  // namespace lumihull::rig
