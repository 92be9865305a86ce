#pragma once

#include <lumihull/capture/mechanism.h>

#include <Eigen/Core>
#include <cstdint>

namespace lumihull::capture {

/// At most 12 cables: no allocation in what is called a million times.
using CableVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>;
using WrenchMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 12>;

/// Errors of all functions here: invalid_argument where a mechanism has no cable or more than 12, or a pose is not
/// finite; degenerate, naming the cable, where its attachment is closer than 1 µm to its departure point (the cable has
/// no direction there; lengths alone are still given).

/// Straight distances l_i = |a_i - p - Q b_i|, m (inverse kinematics; paper, 2.1).
LUMIHULL_API CableVector cable_lengths(const Mechanism& mechanism, const Pose& world_from_platform);

/// A length that makes torques comparable with forces: sqrt(mean |b_i|²), or the platform's radius, or 1 m, where that
/// is zero. Ranks and singular values are those of W with its torque rows divided by it.
LUMIHULL_API double characteristic_length(const Mechanism& mechanism);

/// W: column i is (u_i, c_i x u_i), u_i from the platform to the wall, c_i = Q b_i, moments about the platform's
/// origin in N·m per N. The change of the lengths is -Wᵀ ξ for a twist ξ = (dp, ω) in world axes (paper, eq. 4).
LUMIHULL_API WrenchMatrix wrench_matrix(const Mechanism& mechanism, const Pose& world_from_platform);

enum class Balance : std::uint8_t {
  controlled,  ///< every tension within its limits, W of full rank: the platform stays where it is
  loose,       ///< balanced with t >= 0, but a tension is below its least or above its greatest value
  singular,    ///< balanced with t >= 0, but W has not full rank (smallest singular value < 1e-8; always with fewer
               ///< than six cables): a motion remains that no cable resists
  unbalanced,  ///< no t >= 0 holds the platform here
};

struct Tensions {
  Balance balance = Balance::unbalanced;
  /// Where there is a choice (more than six cables, or singular) the t of least norm within the limits, or, where none
  /// is within them, the t >= 0 of least norm; if unbalanced the t >= 0 of the least residual.
  CableVector tension_N;
  double residual_N = 0;         ///< |W t + r|, torques divided by the characteristic length
  double smallest_singular = 0;  ///< of W with torques divided by the characteristic length; 0 … sqrt(cables)
};

/// Static equilibrium W t = -r, t >= 0 (paper, eq. 3), under gravity alone. A tension of more than -1e-9 of the weight
/// counts as zero.
LUMIHULL_API Tensions tensions(const Mechanism& mechanism, const Pose& world_from_platform);

/// `tensions(…).balance` alone: s(phi, theta) of the paper's eq. 1. Much faster with six cables.
LUMIHULL_API Balance static_test(const Mechanism& mechanism, const Pose& world_from_platform);

}  // namespace lumihull::capture
