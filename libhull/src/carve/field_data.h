#pragma once

// How a sampled field lies in memory: a directory of blocks of 4 x 4 x 4 nodes, and the blocks near the surface.

#include <lumihull/hull/field.h>

#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::hull {

inline constexpr int kBlock = 4;

/// 64 samples; index x + 4 y + 16 z.
struct Leaf {
  std::array<float, 64> phi;  // ±infinity where only the sign is known
  std::uint64_t inside;       // bit per sample: φ < 0
};

/// A directory entry is a leaf's index or one of these.
inline constexpr std::int32_t kOutsideBlock = -1, kInsideBlock = -2;

/// Nodes are the grid's samples and one layer of forced outside around them: node n is sample n - 1.
struct Field::Data {
  Grid grid;
  std::array<int, 3> blocks{};          // of nodes, along x, y, z
  std::vector<std::int32_t> directory;  // x fastest
  std::vector<Leaf> leaves;             // by directory index
  std::size_t samples_inside = 0, samples_evaluated = 0, views_evaluated = 0;

  std::size_t index(int bx, int by, int bz) const {
    return (std::size_t(bz) * std::size_t(blocks[1]) + std::size_t(by)) * std::size_t(blocks[0]) + std::size_t(bx);
  }
};

}  // namespace lumihull::hull
