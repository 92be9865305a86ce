#pragma once

#include <lumihull/calib/key_image.h>

#include "bit_mask.h"

namespace lumihull::calib {

/// Writes the coverage of edge pixels into `out` (which holds the expanded decisions); the rest is left alone.
void soften(const BitMask& decisions, const Image& rgb, EdgeMode mode, Image& out);

}  // namespace lumihull::calib
