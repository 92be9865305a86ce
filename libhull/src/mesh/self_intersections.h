#pragma once

#include <lumihull/hull/mesh.h>

#include <cstddef>
#include <optional>

namespace lumihull::hull {

/// Pairs of triangles of an oriented manifold mesh that pass through each other; nullopt in builds without CGAL.
std::optional<std::size_t> count_self_intersections(const Mesh& mesh);

}  // namespace lumihull::hull
