#pragma once

// Where the refinement begins: camera and poses without any guess.

#include <string>
#include <vector>

#include "refine_lens.h"

namespace lumihull::calib::lens {

struct LensStart {
  Camera camera;
  std::vector<FittedView> views;      ///< those that can be used
  std::vector<std::string> problems;  ///< of the others
  /// Normals of the views' planes in the camera's frame; of a view whose points are not coplanar: zero.
  bool all_planar = true;
};

/// Views of coplanar points give homographies, others projection matrices; the focal length is the one, of those that
/// closed forms and a few guesses propose, with which rigid poses fit best.
/// Errors: degenerate (no view can be used).
LensStart start_lens(std::span<const BoardView> views, int width, int height, const LensCalibrationOptions& options);

}  // namespace lumihull::calib::lens
