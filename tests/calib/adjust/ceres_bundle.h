#pragma once

// The same adjustment written anew for Ceres: automatic derivatives, other parameters, no line shared with the library.

#include <lumihull/calib/adjustment.h>

namespace lumihull::test {

enum class CeresSchur { dense, iterative };

struct CeresAnswer {
  calib::Adjustment adjusted;
  double start_cost = 0, cost = 0;  ///< as AdjustResult's
  int iterations = 0;
};

struct CeresOptions {
  CeresSchur schur = CeresSchur::dense;
  int max_iterations = 200;
  double tolerance = 1e-15;
  int threads = 1;
  bool silent = true;
};

/// Observations all count. Circles only of cameras without distortion and bodies that do not bend.
CeresAnswer adjust_by_ceres(const calib::Adjustment& start, const calib::AdjustOptions& options,
                            const CeresOptions& ceres_options);

}  // namespace lumihull::test
