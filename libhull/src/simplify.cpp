#include <lumihull/base/error.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/simplify.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <optional>

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

/// One pass of meshoptimizer; nullopt where the result is no longer a closed manifold.
std::optional<Mesh> collapsed(const Mesh& mesh, std::size_t target, double max_error) {
  std::vector<unsigned> indices;
  indices.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  const float* positions = mesh.vertices[0].data();
  const float extent = meshopt_simplifyScale(positions, mesh.vertices.size(), sizeof(Eigen::Vector3f));
  const float error = max_error > 0 ? float(max_error / extent) : 1.0f;
  std::vector<unsigned> simplified(indices.size());
  simplified.resize(meshopt_simplify(simplified.data(), indices.data(), indices.size(), positions, mesh.vertices.size(),
                                     sizeof(Eigen::Vector3f), 3 * target, error, 0, nullptr));
  if (simplified.size() < 12) return std::nullopt;
  Mesh candidate = compacted(mesh, simplified);
  if (!check_mesh(candidate, false).good()) return std::nullopt;
  return candidate;
}

/// Collapses in a different order, by way of more triangles or towards fewer, find a way around a pinch.
Mesh reduced_to(const Mesh& mesh, std::size_t most, double max_error, Job& job) {
  Mesh best = mesh;
  for (std::size_t round = 0; round < 16 && best.triangles.size() > most; ++round) {
    job.check();
    const std::size_t target = std::max<std::size_t>(most - round * most / 50, 4);
    std::optional<Mesh> next = collapsed(best, target, max_error);
    if (!next) next = collapsed(best, target + (best.triangles.size() - target) / (2 + round), max_error);
    if (next && next->triangles.size() < best.triangles.size()) best = std::move(*next);
  }
  return best;
}

Mesh reduced_within(const Mesh& mesh, double max_error, Job& job) {
  for (int round = 0; round < 8; ++round, max_error *= 0.8) {
    job.check();
    if (std::optional<Mesh> next = collapsed(mesh, 4, max_error)) return std::move(*next);
  }
  return mesh;
}

}  // namespace

SimplifyResult simplify(const Mesh& mesh, const SimplifyOptions& options, Job& job) {
  if (!std::isfinite(options.max_error) || options.max_error < 0 ||
      (options.max_triangles == 0 && options.max_error == 0))
    throw Error(ErrorCode::invalid_argument, "simplification needs a number of triangles or a positive error");
  validate(mesh, "mesh");
  SimplifyResult result;
  if (mesh.empty()) return result;
  result.mesh = options.max_triangles > 0 ? reduced_to(mesh, options.max_triangles, options.max_error, job)
                                          : reduced_within(mesh, options.max_error, job);
  result.reached = options.max_triangles == 0 || result.mesh.triangles.size() <= options.max_triangles;
  if (result.mesh.triangles.size() < mesh.triangles.size()) {
    const MeshDistance there = distance(mesh, result.mesh, job), back = distance(result.mesh, mesh, job);
    result.moved = {std::max(there.max, back.max), std::max(there.rms, back.rms)};
  }
  return result;
}

}  // namespace lumihull::hull
