#pragma once

#include "lens/resection_points.h"

namespace lumihull::calib {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Sums at a pose, by (rotation vector about the points' centre, shift of that centre in units), camera's axes.
struct NormalEquations {
  Matrix6d information = Matrix6d::Zero();  ///< Σ Jᵀ J
  Vector6d gradient = Vector6d::Zero();     ///< Σ Jᵀ r
  double cost = 0;                          ///< Σ rᵀ r, infinite where a point that counts is not in front
};

struct PoseFit {
  LocalPose pose;
  NormalEquations at;  ///< there
  int iterations = 0;
  bool regular = true;  ///< false: the points that count don't determine the pose
};

/// weights: one a lane, whole blocks; 0 = does not count. cauchy: scale of a Cauchy loss c² log(1 + d²/c²) in standard
/// deviations, with which points that are not in front don't count; 0 = least squares.
NormalEquations normal_equations(const ResectionPoints& points, const LocalPose& pose, std::span<const double> weights,
                                 double cauchy);

/// pose moved by a step of NormalEquations' parameters
LocalPose moved(const LocalPose& pose, const Vector6d& step);

/// Gauss-Newton, damped where it does not help (Levenberg-Marquardt), from fit.pose until a step would lower the cost
/// by less than 1e-12 of it. lens: terms are renewed between rounds until the pose stands still.
void minimise(ResectionPoints& points, std::span<const double> weights, double cauchy, int max_iterations, bool lens,
              PoseFit& fit);

}  // namespace lumihull::calib
