#pragma once

#include "normal_equations.h"

namespace lumihull::calib::bundle {

struct MinimizeOptions {
  int max_iterations = 50;
  double tolerance = 1e-10;  ///< ends where a step changes the cost by less than this share
};

struct MinimizeResult {
  double start_cost = 0, cost = 0;
  int iterations = 0;  ///< steps solved for
  bool converged = false;
};

/// Levenberg-Marquardt: steps (H + λ diag(H) + M Mᵀ) δ = -Jᵀr (NormalEquations::factorize), λ by the share of the
/// predicted gain that a step brings (Nielsen 1999). A step at which a term can't be evaluated is refused as one that
/// gains nothing. Leaves the problem at the kept state of least cost, moved to, and the equations formed somewhere on
/// the way. start_cost: as linearize answered at the kept state, where the equations are formed. Errors: cancelled.
LUMIHULL_API MinimizeResult minimize(LeastSquares& problem, NormalEquations& equations, double start_cost,
                                     const MinimizeOptions& options, Job& job);

}  // namespace lumihull::calib::bundle
