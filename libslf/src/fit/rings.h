#pragma once

#include <lumihull/hull/mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "atlas/atlas.h"

namespace lumihull::slf {

/// A texel of a vertex's ring, and what it counts there: the vertex's hat function Λ, or a little more.
struct RingTexel {
  std::uint32_t texel;
  float share;  // > 0, at most 1
};

/// The surroundings of all vertices in an atlas, and the pictures (slots) that have room for the maps of all of them.
///
/// Bilinear interpolation near a triangle's edge reads texels that show the triangle beyond it. Such a texel belongs to
/// the rings of the corners of both, as far as slots are free: rings reach a texel beyond their triangles. Where a slot
/// is taken, hats are next to zero, or the triangle is hardly larger than a texel.
struct Rings {
  std::vector<std::uint8_t> slot;                      // of each vertex
  std::vector<std::uint32_t> first;                    // of each vertex, in `texels`, and one past the last
  std::vector<RingTexel> texels;                       // ring by ring, ascending
  std::vector<std::array<std::uint32_t, 3>> of_texel;  // where the corners of a texel's triangle have it

  std::span<const RingTexel> of(std::size_t vertex) const {
    return {&texels[first[vertex]], first[vertex + 1] - first[vertex]};
  }
};

/// A slot for each vertex, no two of a triangle alike: the smallest that is free, vertices in order of falling degree.
/// Throws Error{unsupported} where kMaxSlots slots do not suffice.
std::vector<std::uint8_t> slots_of(const hull::Mesh& mesh);

/// slot: see slots_of.
Rings make_rings(const hull::Mesh& mesh, const Atlas& atlas, std::vector<std::uint8_t> slot);

}  // namespace lumihull::slf
