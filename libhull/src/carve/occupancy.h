#pragma once

#include <lumihull/base/job.h>

#include <array>
#include <cstdint>
#include <vector>

#include "hull_function.h"

namespace lumihull::hull {

/// Which cells of a box may contain a part of the hull: conservative, so thin parts are not lost.
struct Occupancy {
  Box box;
  int size = 0;                        // cells along each side of the box (not cubic)
  std::vector<std::uint8_t> occupied;  // x fastest

  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * size + y) * size + x; }
};

/// size: a power of two. Cells that fewer views see whole than `share` (0 … 1) of those that see the best seen occupied
/// cell are not occupied, nor those that one view alone sees: what only few pictures contain says little about where
/// the object is.
Occupancy occupancy(const HullFunction::Impl& function, const Box& box, int size, double share, Job& job);

/// Takes out connected parts (26 neighbours) of less than `min_share` of the largest part's cells.
void remove_specks(Occupancy& cells, double min_share);

/// First and last occupied cell along each axis; false where nothing is occupied.
bool extent(const Occupancy& cells, std::array<int, 3>& first, std::array<int, 3>& last);

}  // namespace lumihull::hull
