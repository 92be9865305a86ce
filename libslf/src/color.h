#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace lumihull::slf {

/// A colour on its way through a weighted mean: sRGB values, 0 … 1. Photographs, texels and a pixel's rays are averaged
/// as they are stored: judged on 8-bit sRGB that was closer to held-out photographs than averages of linear light
/// (README).
struct BlendColor {
  float r = 0, g = 0, b = 0;
  float weight = 0;  ///< 0: not known
};

constexpr float unit_of_srgb8(std::uint8_t value) { return float(value) * (1.0f / 255.0f); }

/// Rounded to nearest, clamped.
inline std::uint8_t srgb8_of_unit(float value) { return std::uint8_t(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f); }

}  // namespace lumihull::slf
