#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/photographer.h>

#include <span>

#include "light/lit_scene.h"
#include "shutter.h"

namespace lumihull::rig {

/// Draws lines over the picture. light: f32, 3 channels, already blurred by the lens; lines are blurred by blur_px, and
/// out of focus by a Gaussian with the second moment of the circle of confusion at each place's depth.
/// Coverage is exact: the outline of a thin cylinder, through the lens in pieces of a few pixels, cut with each pixel's
/// square. Objects and pedestal before a line hide it (4 x 4 rays a pixel), and panels where it leaves the room.
void add_lines(const LitScene& scene, const View& view, std::span<const ThinLine> lines, const Shutter& shutter,
               double blur_px, Image& light);

}  // namespace lumihull::rig
