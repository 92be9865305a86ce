#pragma once

#include <lumihull/calib/key_image.h>

#include "bit_mask.h"

namespace lumihull::calib {

/// Writes the coverage of edge pixels into `out` (which holds the expanded decisions); the rest is left alone.
/// on_edges: whether decisions follow the photograph's edges to a pixel; else mixed colours were taken for object.
void soften(const BitMask& decisions, const Image& rgb, EdgeMode mode, bool on_edges, Image& out);

}  // namespace lumihull::calib
