#pragma once

// Covariance matrix adaptation with restarts, for functions without derivatives.

#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>

namespace lumihull::capture::design {

struct CmaOptions {
  int dimensions = 1;
  std::size_t evaluations = 20000;  ///< in all; may be exceeded by less than one generation
  std::uint64_t seed = 1;
  double first_sigma = 0.3;                                  ///< step, where starts are uniform in the unit cube
  double target = -std::numeric_limits<double>::infinity();  ///< good enough: stop
};

struct CmaResult {
  Eigen::VectorXd x;
  double value = 0;
  std::size_t evaluations = 0;
  int restarts = 0;
};

/// Minimises f over all of R^n: (mu/mu_w, lambda) CMA-ES (Hansen, The CMA Evolution Strategy: A Tutorial, 2016,
/// arXiv:1604.00772), started anew with twice the population where it stalls (IPOP; Auger & Hansen 2005). f is called
/// from job.threads() threads, a generation at a time; the answer depends on the seed alone. NaN counts as +infinity.
/// Counts evaluations as the job's steps, in a stage of this name. Error{cancelled}.
CmaResult cma_es(const CmaOptions& options, const std::function<double(const Eigen::VectorXd&)>& f, Job& job,
                 const std::string& stage);

}  // namespace lumihull::capture::design
