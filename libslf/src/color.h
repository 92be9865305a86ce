#pragma once

#include <array>
#include <cstdint>

namespace lumihull::slf {

/// Linear light (0 … 1) of the 256 values of sRGB.
const std::array<float, 256>& linear_of_srgb8();

/// The 8-bit sRGB value nearest to a linear one; exact (the thresholds between values are tabulated), clamped.
std::uint8_t srgb8_of_linear(float linear);

}  // namespace lumihull::slf
