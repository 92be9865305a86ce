#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Core>
#include <span>

namespace lumihull::rig {

/// Linear light of sheets before a background, f32, 3 channels: every value is the mean over the pixel's square.
/// magnify: the picture is that many times as wide and high as the camera's, its pixels smaller by so much.
/// lines: scan lines a pixel where edges pass. view and prints are valid.
Image flat_coverage(const View& view, std::span<const FlatPrint> prints, const Eigen::Vector3f& background, int lines,
                    int magnify);

}  // namespace lumihull::rig
