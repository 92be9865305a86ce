#include "byte_scale.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lumihull::slf {
namespace {

constexpr double kClipped = 1e-4;  // share of the values that a signed range leaves out
constexpr float kLeast = 1e-6f;    // ranges are never empty

float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * share);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

ByteScale signed_range_of(std::vector<float> values, float least_step) {
  if (values.empty()) return {};
  for (float& v : values) v = std::abs(v);
  const float most = std::max({quantile(values, 1 - kClipped), kLeast, 127 * least_step});
  // 128 stands for zero.
  return {2 * most * 255 / 254, -2 * most * 128 / 254};
}

ByteScale positive_range_of(std::vector<float> values, double clipped) {
  if (values.empty()) return {};
  return {std::max(quantile(values, 1 - clipped), kLeast), 0};
}

std::uint8_t to_byte(float value, const ByteScale& s) {
  return std::uint8_t(std::clamp((value - s.offset) / s.scale * 255 + 0.5f, 0.0f, 255.0f));
}

}  // namespace lumihull::slf
