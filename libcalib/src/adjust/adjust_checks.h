#pragma once

// What an adjustment must be to have an answer.

#include "bundle_problem.h"
#include "normal_equations.h"

namespace lumihull::calib::bundle {

/// Indices, sizes, finite values. Errors: invalid_argument, bad_input (a camera).
void check(const Adjustment& problem);

/// Everything is observed, in parts that hang together. Errors: degenerate, naming what is not.
void check_observed(const Adjustment& problem, const BundleProblem& bundle);

/// Each unknown block on its own is determined by its observations, at the state where the equations are formed.
/// Errors: degenerate, naming the block.
void check_determined(const BundleProblem& bundle, const NormalEquations& equations);

}  // namespace lumihull::calib::bundle
