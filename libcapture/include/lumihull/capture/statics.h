#pragma once

#include <lumihull/capture/mechanism.h>

#include <Eigen/Core>
#include <cstdint>

namespace lumihull::capture {

/// At most 12 cables: no allocation in what is called a million times.
using CableVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>;
using WrenchMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 12>;

/// Straight distances l_i = |a_i - p - Q b_i|, m (inverse kinematics; paper, 2.1).
LUMIHULL_API CableVector cable_lengths(const Mechanism& mechanism, const Pose& world_from_platform);

/// W: column i is (u_i, c_i x u_i), u_i from the platform to the wall, c_i = Q b_i, moments about the platform's
/// origin in N·m per N. The change of the lengths is -Wᵀ ξ for a twist ξ = (dp, ω) in world axes (paper, eq. 4).
LUMIHULL_API WrenchMatrix wrench_matrix(const Mechanism& mechanism, const Pose& world_from_platform);

enum class Balance : std::uint8_t {
  controlled,  ///< every tension within its limits, W of full rank: the platform stays where it is
  loose,       ///< balanced with t >= 0, but a tension is below its least or above its greatest value
  singular,    ///< balanced with t >= 0, but W has not full rank: a motion remains that no cable resists
  unbalanced,  ///< no t >= 0 holds the platform here
};

struct Tensions {
  Balance balance = Balance::unbalanced;
  CableVector tension_N;  ///< of least norm beyond balance where there is a choice; the best t >= 0 if unbalanced
  double residual_N = 0;  ///< |W t + r|, torques divided by the characteristic length
  double smallest_singular = 0;  ///< of W with torques divided by the characteristic length; 0 … sqrt(cables)
};

/// Static equilibrium W t = -r, t >= 0 (paper, eq. 3), under gravity alone.
LUMIHULL_API Tensions tensions(const Mechanism& mechanism, const Pose& world_from_platform);

}  // namespace lumihull::capture
