#pragma once

#include <Eigen/Core>

// Small non-negative least squares, and the least-distance problem that reduces to it, without allocation.

namespace lumihull::capture::internal {

/// At most 12 cables with two limits each.
inline constexpr int kMaxUnknowns = 24;
/// A wrench, or the freedom left to 12 cables and one row more.
inline constexpr int kMaxRows = 13;

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxUnknowns>;
using SmallRows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns, 1>;

/// The x >= 0 that minimises |A x - f|; f - A x comes back in `residual`.
/// Source: Lawson & Hanson 1974, ch. 23 (NNLS), with columns of unit length and inner solutions by QR.
SmallVector non_negative_least_squares(const SmallMatrix& a, const SmallRows& f, SmallRows* residual);

/// The z that minimises |z| subject to G z >= h; false where no z with |z| <= z_max satisfies G z >= h (to rounding).
/// G: at most 24 x 12. Units should be such that z_max is around 1: it separates the two verdicts.
/// Source: Lawson & Hanson 1974, ch. 23 (LDP).
bool least_distance(const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, 12>& g,
                    const SmallVector& h, double z_max, Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>* z);

}  // namespace lumihull::capture::internal
