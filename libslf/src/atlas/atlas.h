#pragma once

#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::slf {

/// A texel that shows a place on the surface. Texels of a chart's rim lie outside its triangles and show the nearest
/// place on them, so that bilinear interpolation up to the edge uses nothing but this chart.
struct Texel {
  std::uint16_t x, y;  // in the texture
  std::uint32_t triangle;
  float b1, b2;  // place = (1 - b1 - b2) v0 + b1 v1 + b2 v2, inside the triangle
};

/// A mesh laid out in a texture.
struct Atlas {
  int width = 0, height = 0;
  double texel_size = 0;  // world units
  std::size_t charts = 0;
  std::vector<std::array<Eigen::Vector2f, 3>> uv;  // of each triangle, in texels
  std::vector<Texel> texels;                       // in blocks of 8 x 8 neighbours of one chart
  std::vector<std::uint32_t> blocks;               // first texel of each block, and one past the last
};

/// The place of a 2-D triangle that is nearest to a point: (1 - b1 - b2) corner 0 + b1 corner 1 + b2 corner 2.
struct NearestPlace {
  float distance2, b1, b2;
};
NearestPlace nearest_in_triangle(const std::array<Eigen::Vector2f, 3>& corners, const Eigen::Vector2f& point);

/// Texels: the farthest texel centre that bilinear interpolation inside a triangle touches.
inline constexpr float kTexelReach = 1.4143f;

/// Lays out a mesh: charts of connected triangles that are seen without overlap along one direction, projected along it
/// (lengths shrink to no less than cos 60°), packed in rows. `texel_size`, in world units, is made larger as needed to
/// fit into max_side².
///
/// No texel shows two places of the surface: a triangle joins a chart only where every texel that interpolation inside
/// it touches is free or shows a place next to its own. Triangles without area get no texels. Throws
/// Error{invalid_argument} where the mesh has too many pieces for a texture of that size.
Atlas make_atlas(const hull::Mesh& mesh, double texel_size, int max_side);

}  // namespace lumihull::slf
