#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>

#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::calib {

/// One byte a pixel, rows without gaps: what circles are looked for on. Values are as the file codes them (sRGB): only
/// their order and rough differences matter here; contours are measured elsewhere, in linear light.
struct GreyLevel {
  int width = 0, height = 0;
  Image pixels;                            ///< empty where `borrowed` is set
  const std::uint8_t* borrowed = nullptr;  ///< a grey photograph's own pixels

  const std::uint8_t* row(int y) const {
    return (borrowed ? borrowed : pixels.row<std::uint8_t>(0)) + std::size_t(y) * std::size_t(width);
  }
};

/// level[0] has the photograph's size, each further one half of it (means of 2 x 2, an odd last line left out), down to
/// the last one whose sides are at least 16 px.
using GreyPyramid = std::vector<GreyLevel>;

/// The photograph as 8 bits, 1 or 3 channels; `photo` itself where it is so already (then `storage` stays empty).
/// Values that are no numbers count as 0.
const Image& eight_bit(const Image& photo, Image& storage);

/// Σ weights · (red, green, blue), |weights| scaled to sum 1 and shifted so that black to white fits into 0 … 255; grey
/// photographs (1 channel) as they are. photo: 8 bits, outlives the pyramid.
GreyPyramid grey_pyramid(const Image& photo, const std::array<float, 3>& weights, Job& job);

/// 255 less each value.
GreyPyramid negative(const GreyPyramid& pyramid, Job& job);

/// 0 where the key says object (ink), 255 elsewhere. photo: 8 bits, 3 channels.
GreyPyramid key_pyramid(const Image& photo, const ColorKey& ink, Job& job);

/// Standard deviation of the noise in eight ranges of 32 grey values: from second differences along rows, medians.
std::array<float, 8> grey_noise(const GreyLevel& level);

}  // namespace lumihull::calib
