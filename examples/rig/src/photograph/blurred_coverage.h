#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Core>
#include <span>

namespace lumihull::rig {

/// Linear light of sheets before a background through a lens that blurs, f32, 3 channels: a Gaussian of `sigma` px (0:
/// none) and the pixel's square. What lies beyond the picture is as at its border. Of several views, which have one
/// camera, the mean: they are moments of the exposure.
Image blurred_coverage(std::span<const View> views, std::span<const FlatPrint> prints,
                       const Eigen::Vector3f& background, int lines, double sigma);

}  // namespace lumihull::rig
