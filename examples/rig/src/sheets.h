#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include "lit_scene.h"

namespace lumihull::rig {

/// Lays the scene's sheets over the picture of its room. light: f32, 3 channels, already blurred by the lens; cover:
/// f32, the part of each pixel that objects cover, blurred alike. Edges of the print are exact (flat_print.h).
void add_sheets(const LitScene& scene, const View& view, double blur_px, const Image& cover, Image& light, Job& job);

}  // namespace lumihull::rig
