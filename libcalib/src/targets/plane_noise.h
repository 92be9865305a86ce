// The noise of a plane, from the plane itself.
#pragma once

#include <lumihull/calib/light_plane.h>

namespace lumihull::calib {

/// Variance as a function of the value, from patches of 8 x 8 pixels (where none is flat: 4 x 4) that a plane explains.
/// Texture, edges and clipped pixels are kept out by clipping at what pure noise can be. What is estimated is the
/// variance of sums over small areas, divided by the number of pixels: for noise that is correlated between neighbours
/// (demosaicing, JPEG) that is what counts in a fit.
///
/// step: of the file's sRGB values (0: none), weights_norm: |w| of the plane's channels: rounding is a floor of the
/// variance.
PlaneNoise estimate_noise(const Image& values, float saturation, double step, double weights_norm);

}  // namespace lumihull::calib
