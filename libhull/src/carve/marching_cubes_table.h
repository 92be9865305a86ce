#pragma once

// The 256 cases of marching cubes (Lorensen & Cline 1987), derived here rather than listed.
//
// On each face of the cube the inside corners that follow one another are cut off together; two inside corners that
// are only diagonal neighbours are cut off apart. That rule looks at the face alone, so two cells agree on the face
// that they share, and every vertex (a crossed edge) gets exactly one segment on each of the four faces around it:
// the polygons form a closed 2-manifold. Polygons are triangulated without diagonals between two edges of one face,
// for the neighbour might draw the same diagonal, too.

#include <array>
#include <cstdint>

namespace lumihull::hull {

/// Corner c of a cell is at (c & 1, c >> 1 & 1, c >> 2).
struct CubeEdge {
  std::uint8_t corner;  // the lower end
  std::uint8_t axis;
};

/// Triangles of one case: edges, counter-clockwise seen from outside.
struct CubeCase {
  std::uint8_t triangles = 0;
  std::array<std::array<std::uint8_t, 3>, 5> edges{};
};

struct CubeTable {
  std::array<CubeEdge, 12> edges;   // edge 4 axis + i
  std::array<CubeCase, 256> cases;  // by bits of inside corners
};

/// Built on first use.
const CubeTable& cube_table();

}  // namespace lumihull::hull
