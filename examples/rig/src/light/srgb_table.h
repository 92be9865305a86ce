#pragma once

#include <lumihull/base/image.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace lumihull::rig {

/// 8-bit sRGB of linear light in steps of 1/65535: below that, sRGB's slope (12.92 x 255 / 65535) is under a level.
inline const std::vector<std::uint8_t>& srgb_table() {
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> t(65536);
    for (std::size_t i = 0; i < t.size(); ++i)
      t[i] = std::uint8_t(std::lround(255 * srgb_from_linear(float(i) / 65535.f)));
    return t;
  }();
  return table;
}

}  // namespace lumihull::rig
