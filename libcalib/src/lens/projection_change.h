#pragma once

// How a change of the intrinsics moves pixels, apart from what a rotation of the camera does as well.

#include <vector>

#include "point_term.h"

namespace lumihull::calib::lens {

/// A place of the picture and how its ray's pixel answers.
struct PixelChange {
  Eigen::Vector2d pixel{0, 0};
  Eigen::Vector3d ray{0, 0, 1};
  Matrix2x10d by_camera = Matrix2x10d::Zero();  ///< d pixel / d parameters of the fixed ray, best rotation taken off
  bool valid = false;                           ///< false: the lens model does not cover this place
};

/// Places in the middles of columns x rows cells, row-major.
///
/// A fixed ray's pixel moves by J_i dθ with the parameters and by G_i w with a small rotation w of the camera, which no
/// photograph can tell from a rotation of everything that it shows. The rotation that takes most of the change off,
/// least squares over the valid places, is w = -(Σ GᵀG)⁻¹ Σ GᵀJ dθ; what is left is (J_i - G_i (Σ GᵀG)⁻¹ Σ GᵀJ) dθ.
std::vector<PixelChange> pixel_changes(const Camera& camera, int columns, int rows);

}  // namespace lumihull::calib::lens
