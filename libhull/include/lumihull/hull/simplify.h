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
  double max_error = 0;           ///< world units: how far a vertex that goes may end up from the surface; 0: no bound
};

struct SimplifyResult {
  Mesh mesh;
  MeshDistance moved;   ///< measured, the larger of both directions
  bool reached = true;  ///< whether max_triangles was reached: keeping the surface manifold comes first
};

/// Fewer triangles for a manifold mesh, which stays closed, manifold and oriented: OpenMesh's edge collapses in the order
/// of quadric errors (Garland & Heckbert 1997), none that would pinch the surface or turn a triangle over. Vertices of
/// the result are vertices of `mesh`. Errors: invalid_argument (neither bound is set, an error that is negative or not
/// finite), bad_input (a mesh that is no manifold), cancelled.
LUMIHULL_API SimplifyResult simplify(const Mesh& mesh, const SimplifyOptions& options, Job& job);

}  // namespace lumihull::hull
