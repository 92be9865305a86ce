#pragma once

#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace lumihull::rig {

struct Polygons {
  hull::Mesh mesh;
  std::vector<Eigen::Vector3f> normals;  ///< one a vertex: the function's gradient
};

/// The surface f = 0 (f < 0 inside) within a box, as a closed, oriented 2-manifold: marching tetrahedra, six to a cube
/// (Kuhn's triangulation, so neighbouring cubes agree); vertices are moved along their edge to the true zero.
/// f must be positive on the box's border. About 14 triangles for each cube that the surface passes.
Polygons polygonize(const std::function<float(const Eigen::Vector3f&)>& f, const Eigen::Vector3f& low,
                    const Eigen::Vector3f& high, float cell);

}  // namespace lumihull::rig
