#pragma once

#include <lumihull/base/image.h>
#include <lumihull/calib/detect_targets.h>

#include <span>
#include <vector>

#include "circle_lattice.h"
#include "read_cells.h"

namespace lumihull::calib {

/// N x N places of a lattice that may be a target.
struct Window {
  int first_design = 0;   ///< a design of the family that is looked for
  std::vector<int> blob;  ///< N x N, row-major; -1: nothing was found there
};

/// What became of a window: a target, or why not.
struct WindowResult {
  bool found = false;
  Detection target;
  RefusedTarget refused;
};

/// Windows of a lattice that read as targets of one of the designs (indices into set.designs, all of the same pitch in
/// radii) and stand apart: beside them the lattice is empty, or belongs to other targets.
std::vector<Window> find_windows(const LightPlane& plane, std::span<const Blob> blobs, const CircleLattice& lattice,
                                 const TargetSet& set, std::span<const int> designs, double strength);

/// Measures a window's circles, reads them, and accepts it or not.
WindowResult read_window(const LightPlane& plane, std::span<const Blob> blobs, const Window& window,
                         const TargetSet& set, const DetectOptions& options);

/// Weights of the plane that a design of circles is looked for on: what tells ink from paper; with solid light circles,
/// ink from bare white paper, between which the printed paper's colour lies.
Eigen::Vector3f circle_weights(const TargetDesign& design);

/// How a design's circles look on that plane.
CircleLook look_of(const TargetDesign& design);

/// Ellipse of a blob.
Ellipse ellipse_of(const Blob& blob);

/// Pixel from plane (n points; circles of `radius` about them) such that predicted ellipse centres meet the measured
/// ones, in least squares of pixels. Three rounds: each takes the offset between ellipse's and circle's centre from the
/// last. Error{degenerate} as find_homography.
Eigen::Matrix3d circle_homography(std::span<const Eigen::Vector2d> plane, double radius,
                                  std::span<const Eigen::Vector2d> pixels);

}  // namespace lumihull::calib
