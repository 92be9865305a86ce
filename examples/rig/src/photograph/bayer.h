#pragma once

#include <lumihull/base/image.h>

namespace lumihull::rig {

/// What a sensor behind a mosaic of filters (RGGB) makes of linear light (f32, 3 channels): one colour a pixel, the
/// others from the mean of the nearest pixels that have them. `clip`: values are clipped to 0 … 1 first, as wells are.
Image through_bayer(const Image& light, bool clip);

}  // namespace lumihull::rig
