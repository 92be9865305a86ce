#pragma once

#include <lumihull/capture/statics.h>

namespace lumihull::capture {

/// The largest motion of the platform that errors of the cables' lengths can make: m per m, and rad per m. Infinite
/// where W has not rank six.
///
/// Source: Cardou, Bouchard & Gosselin 2010 (kinematic sensitivity indices): max |ξ_p| and max |ξ_r| subject to
/// |Wᵀ ξ| <= 1, apart for translation and rotation, as a common norm of both has no unit. Motions are measured by their
/// Euclidean length here, whatever the norm of the lengths' errors.
struct Sensitivity {
  double translation_each = 0, rotation_each = 0;    ///< each length within ±1: the infinity norm
  double translation_joint = 0, rotation_joint = 0;  ///< sum of squares of the lengths' errors <= 1: the 2-norm
};
LUMIHULL_API Sensitivity sensitivity(const Mechanism& mechanism, const Pose& world_from_platform);

}  // namespace lumihull::capture
