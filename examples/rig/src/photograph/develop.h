#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/rig/photographer.h>

#include <cstdint>

namespace lumihull::rig {

/// Linear light (f32, 3 channels) to an 8-bit sRGB picture: exposure, shot and read noise, clipping.
/// Electrons N = exposure x light x full_well; their standard deviation is sqrt(N + read_noise²).
Image develop(const Image& light, const PhotoOptions& options, std::uint64_t seed, Job& job);

/// An f32 picture enlarged `factor` times (Keys' cubic, a = -1/2) and cropped to width x height. Pixel (u, v) of the
/// result shows place (u / factor, v / factor) of the source, in pixels whose first centre is (0.5, 0.5).
Image enlarge(const Image& image, int factor, int width, int height, Job& job);

}  // namespace lumihull::rig
