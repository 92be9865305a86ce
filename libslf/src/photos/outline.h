#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/hull/mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::slf {

/// An edge and the corners that face it in its triangles. An edge of three triangles or more is there for each two of
/// them that follow one another, and once more like one at a hole.
struct MeshEdge {
  std::array<std::uint32_t, 2> ends;
  std::array<std::uint32_t, 2> opposite;  // the second is kNoCorner at a hole
};

inline constexpr std::uint32_t kNoCorner = 0xffffffffu;

/// The edges of a mesh, each once.
std::vector<MeshEdge> mesh_edges(const hull::Mesh& mesh);

/// Marks pixels (row by row, 1: marked) through which an outline passes: an edge whose triangles lie on one side of it,
/// as the camera sees them, or that has but one. No other pixel is crossed by the object's silhouette, nor by the edge
/// of a part that stands before another. `false` where that cannot be said, since an outline leaves the lens's domain
/// or goes behind the camera.
bool mark_outlines(const View& view, const hull::Mesh& mesh, const std::vector<MeshEdge>& edges,
                   std::vector<std::uint8_t>& marks);

}  // namespace lumihull::slf
