#pragma once

// Cholesky's factorisation of a large dense matrix by tiles, on several threads. Exported for tests.

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace lumihull::calib::bundle {

/// Where the tiles of a matrix begin, and the matrix's size at the end: 0 = t[0] < t[1] < … < t[count] = n.
using Tiles = std::vector<Eigen::Index>;

/// A = L Lᵀ, L in place of A's lower triangle; what is above it is neither read nor meaningful afterwards. Tile columns
/// from left to right, each updated by all that are left of it (Golub & Van Loan 2013, 4.2.9). The same bytes for any
/// number of threads.
///
/// least: of each column. Returns the first column whose pivot is not above both this and 0 (A is not positive
/// definite, or nearly not); nothing where all are.
LUMIHULL_API std::optional<Eigen::Index> factorize(Eigen::MatrixXd& a, const Tiles& tiles, const Eigen::VectorXd& least,
                                                   Job& job);

}  // namespace lumihull::calib::bundle
