#pragma once

#include <lumihull/capture/statics.h>

#include <span>

namespace lumihull::capture {

/// Where the platform hangs. Forward kinematics has many answers; all functions here give the one that is reached from
/// a start: the last commanded pose, or a pose that was measured.
struct Hanging {
  Pose world_from_platform;
  CableVector tension_N;  ///< >= 0; zero: the cable is slack
  bool taut = true;       ///< no cable is slack
  int iterations = 0;     ///< Newton steps
};

/// Cables that do not stretch. Newton's method on Wᵀ ξ = l(x) - l* (paper, eq. 4); where the pose found would need
/// to push with a cable, or with more or fewer than six cables, the least height of the centre of mass subject to
/// l_i(x) <= l_i* (augmented Lagrangian, then Newton on the conditions of the first order); the tensions are its
/// multipliers. Accurate to about 1e-12 m.
/// @param lengths_m  one a cable, > 0
/// Errors: invalid_argument; degenerate where no pose near `start` satisfies the lengths, or none is stable.
LUMIHULL_API Hanging hang_rigid(const Mechanism& mechanism, std::span<const double> lengths_m, const Pose& start);

/// Cables that stretch and don't push: the minimum of m g z + sum EA / (2 l0) max(0, l - l0)² by Newton's method in a
/// trust region. Every cable needs stiffness_N > 0.
/// @param unstrained_m  l0, one a cable, > 0
/// Errors: as hang_rigid's.
LUMIHULL_API Hanging hang_elastic(const Mechanism& mechanism, std::span<const double> unstrained_m, const Pose& start);

/// What to wind out so that the platform hangs at a pose: l0 = l / (1 + t / EA) with the tensions of `tensions`; the
/// straight length where EA is 0 (does not stretch). Error{degenerate} where no tensions hold the platform there.
LUMIHULL_API CableVector unstrained_lengths(const Mechanism& mechanism, const Pose& world_from_platform);

}  // namespace lumihull::capture
