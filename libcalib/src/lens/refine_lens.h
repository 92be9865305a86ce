#pragma once

// Minimises the reprojection error over camera and poses.

#include <lumihull/base/job.h>

#include <vector>

#include "point_term.h"

namespace lumihull::calib::lens {

/// A view during calibration.
struct FittedView {
  const BoardView* view = nullptr;
  int index = 0;  ///< in the caller's views
  Pose cam_from_board;
  std::vector<char> counts;  ///< a match: 0 = outlier
};

struct RefineOptions {
  std::array<bool, kIntrinsics> free{};
  double cauchy = 0;  ///< scale of the Cauchy loss, standard deviations; 0: plain least squares
  int max_iterations = 100;
  double tolerance = 1e-14;  ///< relative change of the cost, below which it ends
};

/// Returns iterations. Poses and camera are at a minimum afterwards, or where `max_iterations` ended. Does nothing where a
/// match that counts can't be projected at the start. Errors: cancelled.
int refine_lens(Camera& camera, std::vector<FittedView>& views, const RefineOptions& options, const Job& job);

}  // namespace lumihull::calib::lens
