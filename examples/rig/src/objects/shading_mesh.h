#pragma once

#include <lumihull/rig/object.h>

#include <Eigen/Core>
#include <array>
#include <vector>

namespace lumihull::rig {

/// A mesh with a normal for each vertex; a vertex on a crease occurs once for each side.
struct ShadingMesh {
  hull::Mesh mesh;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<Eigen::Vector2f, 3>> uv;  ///< one a triangle, or empty
};

/// Normals are the object's own, or area-weighted over the faces around a vertex that are less than 35° apart; then all
/// triangles are split in four until the root mean square of their edges is at most `spacing`, or there would be more
/// than two million. The surface stays the same.
ShadingMesh shading_mesh(const Object& object, float spacing);

}  // namespace lumihull::rig
