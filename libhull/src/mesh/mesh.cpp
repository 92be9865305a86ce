#include <lumihull/base/error.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>

#include "mesh_files.h"

namespace lumihull::hull {

void validate(const Mesh& mesh, const std::string& name) {
  if (mesh.vertices.size() >= kMaxVertices)
    throw Error(ErrorCode::bad_input,
                std::to_string(mesh.vertices.size()) + " vertices; at most " + std::to_string(kMaxVertices - 1), name);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (!mesh.vertices[v].allFinite())
      throw Error(ErrorCode::bad_input, "vertex " + std::to_string(v) + " is not finite", name);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t index : mesh.triangles[t])
      if (index >= mesh.vertices.size())
        throw Error(ErrorCode::bad_input,
                    "triangle " + std::to_string(t) + " refers to vertex " + std::to_string(index) + " of " +
                        std::to_string(mesh.vertices.size()),
                    name);
}

std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh) {
  // Sums in double: fans of thousands of slivers cancel in float.
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d n = (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
    for (const std::uint32_t v : t) sums[v] += n;
  }
  std::vector<Eigen::Vector3f> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    const double length = sums[v].norm();
    normals[v] = length > 0 ? Eigen::Vector3f((sums[v] / length).cast<float>()) : Eigen::Vector3f::Zero();
  }
  return normals;
}

double enclosed_volume(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  // Relative to a vertex: far from the origin the terms would cancel.
  const Eigen::Vector3d origin = mesh.vertices[mesh.triangles[0][0]].cast<double>();
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>() - origin;
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>() - origin;
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>() - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

namespace {

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension;
}

[[noreturn]] void unknown_format(const std::filesystem::path& file) {
  throw Error(ErrorCode::invalid_argument, "expected a mesh file whose name ends in .ply or .obj", file.string());
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  if (extension != ".ply" && extension != ".obj") unknown_format(file);
  const std::string text = read_file(file, kMaxMeshFileBytes);
  Mesh mesh = extension == ".ply" ? parse_ply(text, file.string()) : parse_obj(text, file.string());
  validate(mesh, file.string());
  return mesh;
}

void write_mesh(const std::filesystem::path& file, const Mesh& mesh) {
  const std::string extension = lower_extension(file);
  if (extension != ".ply" && extension != ".obj") unknown_format(file);
  validate(mesh, file.string());
  AtomicFile out(file);
  if (extension == ".ply")
    write_ply(out, mesh);
  else
    write_obj(out, mesh);
  out.commit();
}

}  // namespace lumihull::hull
