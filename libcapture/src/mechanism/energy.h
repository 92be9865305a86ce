#pragma once

#include <lumihull/capture/statics.h>

#include <Eigen/Core>

namespace lumihull::capture::internal {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A pose moved by a twist (dp, ω) in world axes: p + dp, exp(ω) Q.
Pose moved(const Pose& pose, const Vector6& twist);

/// A length and its derivatives along `moved` at the twist zero.
struct LengthTerm {
  double length_m = 0;
  Vector6 gradient;  ///< -(u, c x u)
};
/// `hessian` gets factor times the second derivative of the length added, if not null.
LengthTerm cable_length_term(const Cable& cable, const Pose& pose, double factor = 0, Matrix6* hessian = nullptr);

/// Height of the centre of mass times the weight, J.
struct PotentialTerm {
  double energy_J = 0;
  Vector6 gradient;
};
PotentialTerm gravity_term(const Mechanism& mechanism, const Pose& pose, Matrix6* hessian = nullptr);

/// Springs that pull when longer than their natural length: 1/2 k max(0, l - natural)². Natural lengths may be
/// negative: the augmented Lagrangian shifts them.
struct Springs {
  CableVector natural_m, stiffness_N_m;
};
double spring_energy(const Mechanism& mechanism, const Springs& springs, const Pose& pose, Vector6* gradient,
                     Matrix6* hessian);

struct Minimum {
  Pose pose;
  bool converged = false;  ///< gradient zero to rounding, no direction of descent
  int iterations = 0;
};
/// A local minimum of gravity and springs by Newton's method in a trust region that is solved exactly (Moré & Sorensen
/// 1983); stops where the gradient is below `tolerance` of the weight.
Minimum minimise_energy(const Mechanism& mechanism, const Springs& springs, const Pose& start, double tolerance);

}  // namespace lumihull::capture::internal
