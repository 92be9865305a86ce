// Coverage of the pixels at a silhouette's edge, from the colours beside it.
#include "soft_edges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

namespace lumihull::calib {
namespace {

constexpr int kRadius = 3;             // of the window for local means, px
constexpr float kLeastContrast = 400;  // |F - B|², 8-bit values: below it colours say nothing about coverage
// Squared distance from the line through B and F up to which a colour may be a mixture: noise, and a share of |F - B|².
constexpr float kNoise = 300, kPlay = 0.02f;

struct Mean {
  int count = 0;
  std::array<int, 3> sum{};
};

/// Sum of the colours of a window's pixels that are set.
Mean mean_of(const BitMask& mask, const Image& rgb, int x, int y) {
  Mean mean;
  const int x0 = std::max(0, x - kRadius), x1 = std::min(mask.width - 1, x + kRadius);
  for (int v = std::max(0, y - kRadius); v <= std::min(mask.height - 1, y + kRadius); ++v) {
    const std::uint64_t* row = mask.row(v);
    std::uint64_t window = row[x0 >> 6] >> (x0 & 63);
    if ((x0 >> 6) != (x1 >> 6)) window |= row[x1 >> 6] << (64 - (x0 & 63));
    window &= (std::uint64_t(1) << (x1 - x0 + 1)) - 1;
    const std::uint8_t* pixels = rgb.row<std::uint8_t>(v);
    for (; window; window &= window - 1) {
      const std::uint8_t* p = pixels + 3 * (x0 + std::countr_zero(window));
      ++mean.count;
      for (std::size_t c = 0; c < 3; ++c) mean.sum[c] += p[c];
    }
  }
  return mean;
}

}  // namespace

void soften(const BitMask& decisions, const Image& rgb, EdgeMode mode, Image& out) {
  // The uniform foreground makes nearly every mixed colour object: the band that is not to be trusted lies mostly on
  // the object's side of the boundary.
  const BitMask background = complement(decisions);
  const BitMask sure_background = eroded(background, false);
  const BitMask inner = eroded(decisions, true), sure_object = eroded(inner, false);
  const BitMask narrow_object = eroded(decisions, false);
  for (int y = 0; y < decisions.height; ++y) {
    std::uint8_t* alpha = out.row<std::uint8_t>(y);
    const std::uint8_t* pixels = rgb.row<std::uint8_t>(y);
    for (int w = 0; w < decisions.words; ++w) {
      const std::uint64_t object = decisions.row(y)[w];
      const std::uint64_t trusted_object = mode == EdgeMode::matte ? sure_object.row(y)[w] : narrow_object.row(y)[w];
      std::uint64_t edge = (object & ~trusted_object) | (background.row(y)[w] & ~sure_background.row(y)[w]);
      for (; edge; edge &= edge - 1) {
        const int x = 64 * w + std::countr_zero(edge);
        const Mean b = mean_of(sure_background, rgb, x, y);
        if (b.count == 0) continue;
        Mean f = mean_of(sure_object, rgb, x, y);
        if (f.count == 0) f = mean_of(narrow_object, rgb, x, y);
        if (f.count == 0) continue;
        float along = 0, length = 0, distance = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const float mean_b = float(b.sum[c]) / float(b.count), d = float(f.sum[c]) / float(f.count) - mean_b;
          const float from_b = float(pixels[3 * std::size_t(x) + c]) - mean_b;
          along += from_b * d;
          length += d * d;
          distance += from_b * from_b;
        }
        if (length < kLeastContrast) continue;
        // A colour far off the line from B to F is no mixture of them (a dark contour, a stripe): its decision stands.
        const float off_line = distance - along * along / length;
        const bool mixture = off_line < kNoise + kPlay * length;
        int a = int(std::lround(255 * std::clamp(along / length, 0.0f, 1.0f)));
        if (mode == EdgeMode::soft || !mixture) a = (object >> (x & 63) & 1) ? std::max(a, 128) : std::min(a, 127);
        alpha[x] = std::uint8_t(a);
      }
    }
  }
}

}  // namespace lumihull::calib
