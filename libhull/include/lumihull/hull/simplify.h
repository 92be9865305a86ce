#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <cstddef>

namespace lumihull::hull {

/// How far the vertices and triangle centres of one mesh are from another's surface, world units.
struct MeshDistance {
  double max = 0, rms = 0;
};

/// By Embree's point queries, exact to single precision. Errors: bad_input, invalid_argument (an empty mesh).
LUMIHULL_API MeshDistance distance(const Mesh& from, const Mesh& to, Job& job);

struct SimplifyOptions {
  std::size_t max_triangles = 0;  ///< at most so many are aimed at; 0: as few as the error allows
  double max_error = 0;           ///< world units, by the simplifier's own (quadric) estimate; 0: no bound
};

struct SimplifyResult {
  Mesh mesh;
  MeshDistance moved;   ///< measured, the larger of both directions
  bool reached = true;  ///< whether max_triangles was reached: keeping the surface manifold comes first
};

/// Fewer triangles for a closed manifold mesh, which stays closed, manifold and oriented: quadric edge collapses by
/// meshoptimizer, each result checked; where a collapse pinched the surface, other orders of collapses are tried, and
/// what was reached without is returned (at worst the mesh as it was). Errors: invalid_argument (neither bound is set,
/// an error that is negative or not finite), bad_input, cancelled.
LUMIHULL_API SimplifyResult simplify(const Mesh& mesh, const SimplifyOptions& options, Job& job);

}  // namespace lumihull::hull
