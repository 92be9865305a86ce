#pragma once

#include <lumihull/slf/light_field.h>

#include <cstdint>
#include <vector>

namespace lumihull::slf {

/// The range that holds all values but a few outliers, around zero so that a byte stands for zero exactly. least_step:
/// what bytes are apart at least, so that those which say no more than that pack well.
ByteScale signed_range_of(std::vector<float> values, float least_step = 0);

/// The range from zero (byte 0) that holds all values, which must be >= 0, but a share `clipped` of the largest.
ByteScale positive_range_of(std::vector<float> values, double clipped);

/// Rounded to nearest, clamped.
std::uint8_t to_byte(float value, const ByteScale& scale);

}  // namespace lumihull::slf
