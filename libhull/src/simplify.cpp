#include <lumihull/base/error.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/simplify.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

namespace lumihull::hull {
namespace {

/// Drops vertices that no triangle uses.
Mesh compacted(const Mesh& mesh, const std::vector<unsigned>& indices) {
  Mesh out;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), ~std::uint32_t(0));
  for (const unsigned v : indices) renumbered[v] = 0;
  for (std::size_t v = 0; v < renumbered.size(); ++v)
    if (renumbered[v] == 0) {
      renumbered[v] = std::uint32_t(out.vertices.size());
      out.vertices.push_back(mesh.vertices[v]);
    }
  out.triangles.reserve(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); i += 3)
    out.triangles.push_back({renumbered[indices[i]], renumbered[indices[i + 1]], renumbered[indices[i + 2]]});
  return out;
}

}  // namespace

SimplifyResult simplify(const Mesh& mesh, const SimplifyOptions& options, Job& job) {
  if (!std::isfinite(options.max_error) || options.max_error < 0 ||
      (options.max_triangles == 0 && options.max_error == 0))
    throw Error(ErrorCode::invalid_argument, "simplification needs a number of triangles or a positive error");
  validate(mesh, "mesh");
  SimplifyResult result;
  result.mesh = mesh;
  if (mesh.empty()) return result;
  std::vector<unsigned> indices;
  indices.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  const float* positions = mesh.vertices[0].data();
  const float extent = meshopt_simplifyScale(positions, mesh.vertices.size(), sizeof(Eigen::Vector3f));
  const float error = options.max_error > 0 ? float(options.max_error / extent) : 1.0f;

  std::size_t target = options.max_triangles > 0 ? options.max_triangles : 4;
  while (target < mesh.triangles.size()) {
    job.check();
    std::vector<unsigned> simplified(indices.size());
    float moved = 0;
    simplified.resize(meshopt_simplify(simplified.data(), indices.data(), indices.size(), positions,
                                       mesh.vertices.size(), sizeof(Eigen::Vector3f), 3 * target, error, 0, &moved));
    if (simplified.size() >= 12) {
      Mesh candidate = compacted(mesh, simplified);
      if (check_mesh(candidate, false).good()) {
        result.mesh = std::move(candidate);
        break;
      }
    }
    // Where it can't get below a number, the next larger one to try is beyond that.
    target = std::max(target, simplified.size() / 3);
    target += target / 4 + 16;
  }
  result.reached = options.max_triangles == 0 || result.mesh.triangles.size() <= options.max_triangles;
  if (result.mesh.triangles.size() < mesh.triangles.size()) {
    const MeshDistance there = distance(mesh, result.mesh, job), back = distance(result.mesh, mesh, job);
    result.moved = {std::max(there.max, back.max), std::max(there.rms, back.rms)};
  }
  return result;
}

}  // namespace lumihull::hull
