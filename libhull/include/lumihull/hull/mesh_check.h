#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <cstddef>
#include <optional>

namespace lumihull::hull {

/// What a mesh is, as a surface.
struct MeshCheck {
  bool closed = false;                   ///< every edge has two triangles
  bool manifold = false;                 ///< closed, and the triangles around every used vertex are one fan
  bool oriented = false;                 ///< every edge is passed once in each direction
  std::size_t degenerate_triangles = 0;  ///< with a repeated vertex, or two vertices at one place, or no area
  std::size_t unused_vertices = 0;
  std::size_t parts = 0;     ///< connected by shared vertices
  std::ptrdiff_t euler = 0;  ///< vertices - edges + triangles; 2 for each sphere-like part
  double volume = 0;
  /// Pairs of triangles that pass through each other, by CGAL; nullopt where Lumihull was built without it, or where
  /// the mesh isn't manifold.
  std::optional<std::size_t> self_intersections;

  bool good() const { return closed && manifold && oriented && degenerate_triangles == 0; }
};

/// Errors: bad_input (an index out of range). self_intersections: about 5 microseconds a triangle; leave out if not
/// needed.
LUMIHULL_API MeshCheck check_mesh(const Mesh& mesh, bool self_intersections = true);

}  // namespace lumihull::hull
