#pragma once

#include <lumihull/capture/statics.h>

namespace lumihull::capture {

/// A cable that hangs under its own weight, in its vertical plane, from the platform (the origin) to its departure
/// point; V is what it pulls the platform upwards with, H towards the wall.
///
///     x = H L0 / EA + H / w (asinh((V + w L0) / H) - asinh(V / H))
///     z = (V L0 + w L0² / 2) / EA + (T1 - T0) / w,      T0² = H² + V²,  T1² = H² + (V + w L0)²
///
/// with w = density x gravity. Source: Irvine 1981, ch. 1; the formulas hold for w = 0 and EA = infinite, too.
struct LUMIHULL_API HangingCable {
  double length_m = 0;       ///< L0, unstrained
  double pull_N = 0;         ///< H >= 0
  double lift_N = 0;         ///< V, any sign: a slack cable hangs below the platform and pulls it down
  double tension_N() const;  ///< T0, at the platform
};

/// Properties of a cable; stiffness_N = 0: does not stretch.
struct CableKind {
  double weight_N_m = 0;   ///< w >= 0
  double stiffness_N = 0;  ///< EA >= 0
};

/// (x, z) for H > 0, V, L0 > 0; jacobian, if not null: d(x, z) / d(H, V, L0).
LUMIHULL_API Eigen::Vector2d cable_end(const CableKind& kind, const HangingCable& cable,
                                       Eigen::Matrix<double, 2, 3>* jacobian = nullptr);

/// The cable between given ends that has a given tension at the platform: the tauter one of the two that may exist.
/// @param along_m    horizontal distance, > 0
/// @param rise_m     of the departure point over the platform
/// @param tension_N  > 0
/// Errors: invalid_argument; degenerate where the cable's own weight needs more tension than that.
LUMIHULL_API HangingCable cable_of_tension(const CableKind& kind, double along_m, double rise_m, double tension_N);

/// The cable between given ends that has a given unstrained length. Its weight or its stretch must decide how it hangs.
/// Errors: invalid_argument; degenerate where it is too short to reach (EA = 0), or nothing decides (w = 0 and slack).
LUMIHULL_API HangingCable cable_of_length(const CableKind& kind, double along_m, double rise_m, double length_m);

/// Unstrained lengths with which the platform hangs at a pose when its six cables sag and stretch as their density_kg_m
/// and stiffness_N say (inverse kinematics). Error{degenerate} where no positive tensions hold it.
LUMIHULL_API std::vector<HangingCable> sagging_cables(const Mechanism& mechanism, const Pose& world_from_platform);

}  // namespace lumihull::capture
