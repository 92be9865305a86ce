#pragma once

// Normal equations of a calibration, poses eliminated: covariances, and how observable the parameters are.

#include <vector>

#include "refine_lens.h"

namespace lumihull::calib::lens {

struct LensCovariance {
  /// (JᵀJ)⁻¹ of the free parameters with all poses estimated along; zero rows for fixed ones. Not scaled by sigma0.
  Eigen::Matrix<double, kIntrinsics, kIntrinsics> covariance =
      Eigen::Matrix<double, kIntrinsics, kIntrinsics>::Zero();
  /// Least eigenvalue of the free parameters' normal equations, poses eliminated, scaled to a unit diagonal before that
  /// elimination: 1 = as if the poses were known, 0 = some combination of parameters can't be told from motion.
  double least_eigenvalue = 1;
  double chi2 = 0;  ///< Σ rᵀ Σ⁻¹ r of the matches that count
  int points = 0;   ///< that count
  int unknowns = 0;
};

/// Matches that can't be projected do not count.
LensCovariance lens_covariance(const Camera& camera, const std::vector<FittedView>& views,
                               const std::array<bool, kIntrinsics>& free);

}  // namespace lumihull::calib::lens
