// The one file that includes CGAL's polygon mesh processing, which is GPL: see LUMIHULL_CGAL.

#include "self_intersections.h"

#ifdef LUMIHULL_CGAL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <iterator>
#include <utility>
#include <vector>

namespace lumihull::hull {

std::optional<std::size_t> count_self_intersections(const Mesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
  Surface surface;
  surface.reserve(Surface::size_type(mesh.vertices.size()), Surface::size_type(3 * mesh.triangles.size() / 2),
                  Surface::size_type(mesh.triangles.size()));
  for (const Eigen::Vector3f& v : mesh.vertices) surface.add_vertex({v.x(), v.y(), v.z()});
  for (const auto& t : mesh.triangles)
    if (surface.add_face(Surface::Vertex_index(t[0]), Surface::Vertex_index(t[1]), Surface::Vertex_index(t[2])) ==
        Surface::null_face())
      return std::nullopt;
  std::vector<std::pair<Surface::Face_index, Surface::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(surface, std::back_inserter(pairs));
  return pairs.size();
}

}  // namespace lumihull::hull

#else

namespace lumihull::hull {

std::optional<std::size_t> count_self_intersections(const Mesh&) { return std::nullopt; }

}  // namespace lumihull::hull

#endif
