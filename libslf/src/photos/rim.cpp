#include "rim.h"

#include <lumihull/base/image.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "color.h"

namespace lumihull::slf {
namespace {

constexpr int kBackgroundReach = 5;  // px: so far away the background is looked for
constexpr float kAlphaError = 0.1f;  // of a keyed mask
// sRGB values: what the background may differ from all that is seen of it nearby, and what noise may make of a pixel.
constexpr float kBackgroundError = 8.0f / 255, kNoise = 3.0f / 255;

}  // namespace

Rim::Rim(const Photo& photo) : photo_(photo) {
  for (std::size_t i = 0; i < 256; ++i) light_[i] = linear_from_srgb(unit_of_srgb8(std::uint8_t(i)));
}

/// No mask is so sharp that its 0 beside a covered pixel could not hide some of the object.
bool Rim::is_clear(int x, int y) const {
  const Image& alpha = photo_.alpha;
  for (int j = std::max(0, y - 1); j <= std::min(alpha.height() - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(alpha.width() - 1, x + 1); ++i)
      if (alpha.row<std::uint8_t>(j)[i] != 0) return false;
  return true;
}

bool Rim::is_mixture(int x, int y, float reach) const {
  const Image &rgb = photo_.rgb, &alpha = photo_.alpha;
  const int w = rgb.width(), h = rgb.height(), r = std::max(kBackgroundReach, int(reach));
  const std::uint8_t* object = nullptr;
  float nearest = reach * reach;
  std::array<float, 3> darkest{2, 2, 2}, brightest{-1, -1, -1};
  for (int j = std::max(0, y - r); j <= std::min(h - 1, y + r); ++j)
    for (int i = std::max(0, x - r); i <= std::min(w - 1, x + r); ++i) {
      const std::uint8_t a = alpha.row<std::uint8_t>(j)[i];
      const std::uint8_t* p = rgb.row<std::uint8_t>(j) + 3 * i;
      const auto d = float((i - x) * (i - x) + (j - y) * (j - y));
      if (a >= kWholePixel) {
        if (d < nearest || (d == nearest && !object)) nearest = d, object = p;
      } else if (a == 0 && std::max(std::abs(i - x), std::abs(j - y)) <= kBackgroundReach && is_clear(i, j)) {
        for (std::size_t c = 0; c < 3; ++c) {
          darkest[c] = std::min(darkest[c], light_[p[c]]);
          brightest[c] = std::max(brightest[c], light_[p[c]]);
        }
      }
    }
  if (!object || brightest[0] < 0) return false;
  for (std::size_t c = 0; c < 3; ++c) {
    darkest[c] = linear_from_srgb(std::max(0.0f, srgb_from_linear(darkest[c]) - kBackgroundError));
    brightest[c] = linear_from_srgb(std::min(1.0f, srgb_from_linear(brightest[c]) + kBackgroundError));
  }
  const float a = unit_of_srgb8(alpha.row<std::uint8_t>(y)[x]);
  const float less = std::max(0.0f, a - kAlphaError), more = std::min(1.0f, a + kAlphaError);
  const std::uint8_t* seen = rgb.row<std::uint8_t>(y) + 3 * x;
  for (std::size_t c = 0; c < 3; ++c) {
    const float o = light_[object[c]];
    const auto mixed = [&](float share, float background) { return share * o + (1 - share) * background; };
    const float low = std::min(mixed(less, darkest[c]), mixed(more, darkest[c]));
    const float high = std::max(mixed(less, brightest[c]), mixed(more, brightest[c]));
    const float value = unit_of_srgb8(seen[c]);
    if (value < srgb_from_linear(low) - kNoise || value > srgb_from_linear(high) + kNoise) return false;
  }
  return true;
}

}  // namespace lumihull::slf
