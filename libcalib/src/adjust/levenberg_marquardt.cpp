#include "levenberg_marquardt.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::calib::bundle {

MinimizeResult minimize(LeastSquares& problem, NormalEquations& equations, double start_cost,
                        const MinimizeOptions& options, Job& job) {
  const Eigen::VectorXd stay = Eigen::VectorXd::Zero(equations.unknowns());
  MinimizeResult result;
  result.start_cost = result.cost = start_cost;

  // Residuals of a few 1e-9 standard deviations: nothing but rounding is left.
  double rounding = 0;
  for (const Term& term : problem.terms) rounding += 1e-17 * term.rows;

  double lambda = 1e-4, growth = 2;
  while (!result.converged && result.iterations < options.max_iterations && lambda < 1e16) {
    ++result.iterations;
    const auto refuse = [&] {
      lambda *= growth;
      growth *= 2;
    };
    if (equations.factorize(lambda, problem.gauge(), 0, job)) {
      refuse();
      continue;
    }
    const Eigen::VectorXd step = equations.solve(-equations.gradient(), job);
    // Gain of the quadratic model, -2 gᵀδ - δᵀHδ, by what δ solves.
    const double predicted = -equations.gradient().dot(step) +
                             lambda * step.dot(equations.diagonal().cwiseProduct(step)) +
                             equations.along_gauge(step).squaredNorm();
    double cost = std::numeric_limits<double>::infinity();
    if (step.allFinite() && problem.move(step)) cost = equations.cost(problem, job).value_or(cost);
    const double gain = result.cost - cost;
    // A gain that small under heavy damping is no sign of the end. A loss that small is that of rounding, or of what
    // derivatives neglect.
    const double least = options.tolerance * result.cost, neglected = problem.neglected * result.cost;
    result.converged = lambda < 1 && (predicted <= least || (gain <= least && gain >= -std::max(least, neglected)) ||
                                      result.cost <= rounding);
    if (!(gain >= 0) || !(predicted > 0)) {
      refuse();
      continue;
    }
    problem.keep();
    result.cost = cost;
    const double share = gain / predicted;
    lambda = std::max(lambda * std::clamp(1 - std::pow(2 * share - 1, 3), 0.05, 2.0), 1e-14);
    growth = 2;
    if (!result.converged && !equations.linearize(problem, job))
      throw Error(ErrorCode::internal, "an adjustment can't be evaluated where it just was");
  }
  problem.move(stay);
  return result;
}

}  // namespace lumihull::calib::bundle
