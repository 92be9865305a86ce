#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "circle_blobs.h"

namespace lumihull::calib {

/// Blobs that stand like the circles of a printed grid: columns x rows places, row-major, right-handed as one looks at
/// the print (columns to the right, rows down, up to a quarter turn). -1: nothing was found there.
struct CircleLattice {
  int columns = 0, rows = 0;
  std::vector<int> blob;  ///< index into the blobs

  int at(int column, int row) const {
    return column < 0 || row < 0 || column >= columns || row >= rows ? -1 : blob[std::size_t(row * columns + column)];
  }
};

/// Groups blobs into lattices. What is asked of neighbours is asked in the metric of the ellipse itself, where the
/// print's affine picture is undone but for a rotation: the next circle is `pitch_in_radii` away, the one in the other
/// direction at a right angle, with the same shape. From such a corner of four the lattice grows place by place, each
/// predicted by its neighbours, so that perspective and the lens's distortion need only be smooth.
///
/// Lattices of fewer than least x least places are left out. Each blob is in one lattice at most.
std::vector<CircleLattice> find_lattices(std::span<const Blob> blobs, double pitch_in_radii, int least);

}  // namespace lumihull::calib
