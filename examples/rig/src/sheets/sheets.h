#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include "light/lit_scene.h"
#include "photograph/shutter.h"

namespace lumihull::rig {

/// Lays the scene's sheets over the picture of its room. light: f32, 3 channels, already blurred by the lens; cover:
/// f32, the part of each pixel that objects cover, blurred alike. Edges of the print are exact (flat_print.h). Motion
/// is the mean over moments that are at most .75 px apart; a sheet out of focus is blurred by a Gaussian with the
/// second moment of its circle of confusion (a quarter of the diameter), that of the sheet's middle.
void add_sheets(const LitScene& scene, const View& view, const Shutter& shutter, double blur_px, const Image& cover,
                Image& light, Job& job);

}  // namespace lumihull::rig
