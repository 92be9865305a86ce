#pragma once

// What carving does with one block of samples and one view: bound it, or evaluate it eight samples at a time.

#include <array>
#include <vector>

#include "hull_function.h"

namespace lumihull::hull {

/// A view, laid out for blocks of one grid.
struct BlockView {
  BlockView(const ProjectedView& view, double voxel);

  const ProjectedView* view;
  // Per lane (x = lane % 4, y = lane / 4) and per row of lanes (two in y, four in z): steps of U, V, Z.
  alignas(32) std::array<float, 8> lane_u, lane_v, lane_z, row_u, row_v, row_z;
  float scale;    // quantum: φ = scale * sample * Z
  double error;   // |φ in single precision - φ| <= error * Z, where a leaf's depths are all about Z
  double beyond;  // a leaf's largest Z exceeds its first sample's by at most this …
  double before;  // … and its smallest is less by at most this
};

/// Bits (CellState) of what a view sees of the box center ± half, at least; 0: that can't be bounded, for part of the
/// box is behind the camera.
std::uint8_t bound(const ProjectedView& view, const Eigen::Vector3d& center, const Eigen::Vector3d& half);

/// The m largest φ_i of 64 samples (index x + 4 y + 16 z), descending: top[r][sample].
using Top = std::vector<std::array<float, 64>>;

/// Merges one view's φ_i over the leaf whose first sample is at `first` into `top`. The view must see all of it.
/// Returns the bound of the rounding error.
double merge(const BlockView& view, const Eigen::Vector3d& first, Top& top);

}  // namespace lumihull::hull
