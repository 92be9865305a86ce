#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/adjustment.h>

#include <cmath>

#include "adjust_checks.h"
#include "levenberg_marquardt.h"

namespace lumihull::calib {
namespace {

using bundle::BundleProblem;
using bundle::NormalEquations;

void fill_residuals(const BundleProblem& problem, std::size_t observations, AdjustResult& result, Job& job) {
  result.residuals.resize(observations);
  parallel_chunks(job, observations, 1024, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) result.residuals[i] = problem.residual(i);
  });
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < observations; ++i) {
    if (!problem.counts(i)) continue;
    sum += result.residuals[i].squaredNorm();
    ++count;
  }
  result.rms_px = std::sqrt(sum / double(count));
}

void fill_covariances(const Adjustment& a, BundleProblem& problem, NormalEquations& equations, AdjustResult& result,
                      Job& job) {
  if (!equations.linearize(problem, job)) throw Error(ErrorCode::internal, "the answer can't be evaluated again");
  const Eigen::MatrixXd gauge = problem.gauge();
  constexpr double kLeastShare = 1e-13;  // rounding leaves 1e-15
  if (const auto weak = equations.factorize(0, gauge, kLeastShare, job))
    throw Error(ErrorCode::degenerate, "the observations do not determine it beside the other unknowns",
                problem.name(*weak));
  const bundle::BlockCovariances c = equations.covariances(
      gauge, problem.datum(), std::vector<char>(problem.sizes.size(), 1), problem.print_block(), job);

  for (std::size_t s = 0; s < a.shots.size(); ++s) result.shot_covariances.push_back(c.of[problem.shot_block(s)]);
  for (std::size_t k = 0; k < a.cameras.size(); ++k) {
    auto& lens = result.camera_covariances.emplace_back();
    lens.setZero();
    if (const int block = problem.camera_block(k); block >= 0) {
      const std::vector<int>& free = problem.free_intrinsics(k);
      for (std::size_t i = 0; i < free.size(); ++i)
        for (std::size_t j = 0; j < free.size(); ++j)
          lens(free[i], free[j]) = c.of[std::size_t(block)](Eigen::Index(i), Eigen::Index(j));
    }
    auto& rig = result.rig_covariances.emplace_back();
    rig.setZero();
    if (const int block = problem.rig_block(k); block >= 0) rig = c.of[std::size_t(block)];
  }
  if (const int print = problem.print_block(); print >= 0) result.print_covariance = c.of[std::size_t(print)];

  Eigen::Matrix<double, 3, Eigen::Dynamic> by_block;
  Eigen::Matrix<double, 3, 2> by_print;
  for (std::size_t b = 0; b < a.bodies.size(); ++b) {
    auto& of_body = result.point_covariances.emplace_back();
    for (std::size_t i = 0; i < a.bodies[b].points.size(); ++i) {
      const int block = problem.body_block(b, i);
      if (block < 0) {
        of_body.push_back(Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN()));
        continue;
      }
      problem.point_jacobian(b, i, by_block, by_print);
      Eigen::Matrix3d q = by_block * c.of[std::size_t(block)] * by_block.transpose();
      if (const int print = problem.print_block(); print >= 0) {
        const Eigen::Matrix3d cross = by_block * c.with[std::size_t(block)] * by_print.transpose();
        q += cross + cross.transpose() + by_print * c.of[std::size_t(print)] * by_print.transpose();
      }
      of_body.push_back(q);
    }
  }
}

}  // namespace

void AdjustOptions::validate() const {
  const auto check = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::invalid_argument, std::string("adjustment: ") + what);
  };
  check(robust_sigma >= 0 && std::isfinite(robust_sigma), "robust_sigma must be >= 0");
  check(bend_sigma > 0 && std::isfinite(bend_sigma), "bend_sigma must be positive");
  check(max_iterations >= 1 && max_iterations <= 1000, "max_iterations must be 1 … 1000");
  check(tolerance >= 0 && tolerance < 1, "tolerance must be 0 … 1");
}

AdjustResult adjust(const Adjustment& start, const AdjustOptions& options, Job& job) {
  options.validate();
  bundle::check(start);
  BundleProblem problem(start, options);
  bundle::check_observed(start, problem);
  NormalEquations equations(problem);
  const auto start_cost = equations.linearize(problem, job);
  if (!start_cost) throw Error(ErrorCode::bad_input, "the start's residuals are not finite", "adjustment");
  bundle::check_determined(problem, equations);

  const bundle::MinimizeResult minimum =
      bundle::minimize(problem, equations, *start_cost, {options.max_iterations, options.tolerance}, job);
  problem.align();

  AdjustResult result;
  result.adjusted = problem.adjusted();
  result.start_cost = minimum.start_cost, result.cost = minimum.cost;
  result.iterations = minimum.iterations, result.converged = minimum.converged;
  fill_residuals(problem, start.observations.size(), result, job);
  result.redundancy = problem.redundancy();
  result.sigma0 = result.redundancy > 0 ? std::sqrt(problem.chi2() / double(result.redundancy)) : 0;
  if (options.covariances) fill_covariances(start, problem, equations, result, job);
  return result;
}

}  // namespace lumihull::calib
