// Coverage of the pixels at a silhouette's edge, from the colours beside it.
#include "soft_edges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace lumihull::calib {
namespace {

constexpr int kWide = 3, kClose = 2;   // radius of the window for local means, px
constexpr float kLeastContrast = 400;  // |F - B|², 8-bit values: below it colours say nothing about coverage
// Squared distance from the line through B and F up to which a colour may be a mixture: noise, and a share of |F - B|².
constexpr float kNoise = 300, kPlay = 0.02f;

struct Mean {
  int count = 0;
  std::array<int, 3> sum{};
};

#ifdef __AVX2__
/// Bytes of a row of seven pixels (RGB, eleven bytes too many) where the pixel's bit is set.
alignas(32) constexpr std::array<std::array<std::uint8_t, 32>, 128> kSetBytes = [] {
  std::array<std::array<std::uint8_t, 32>, 128> bytes{};
  for (std::size_t bits = 0; bits < 128; ++bits)
    for (std::size_t i = 0; i < 21; ++i) bytes[bits][i] = (bits >> (i / 3) & 1) ? 255 : 0;
  return bytes;
}();

/// Sums of the bytes whose number is 0, 1 or 2 modulo 3.
class ChannelSums {
 public:
  void add(const std::uint8_t* bytes, std::uint64_t window) {
    const __m256i set = _mm256_load_si256(reinterpret_cast<const __m256i*>(kSetBytes[window].data()));
    const __m256i here = _mm256_and_si256(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes)), set);
    for (std::size_t c = 0; c < 3; ++c)
      sums_[c] =
          _mm256_add_epi64(sums_[c], _mm256_sad_epu8(_mm256_shuffle_epi8(here, channel(c)), _mm256_setzero_si256()));
  }
  int sum(std::size_t c) const {
    const __m128i two = _mm_add_epi64(_mm256_castsi256_si128(sums_[c]), _mm256_extracti128_si256(sums_[c], 1));
    return int(_mm_cvtsi128_si64(two) + _mm_extract_epi64(two, 1));
  }

 private:
  /// Picks a channel's bytes of each half (the upper half starts at byte 16, which is channel 1).
  static __m256i channel(std::size_t c) {
    const char n = -1;
    const __m256i pick[3] = {_mm256_setr_epi8(0, 3, 6, 9, 12, 15, n, n, n, n, n, n, n, n, n, n, 2, n, n, n, n, n, n, n,
                                              n, n, n, n, n, n, n, n),
                             _mm256_setr_epi8(1, 4, 7, 10, 13, n, n, n, n, n, n, n, n, n, n, n, 0, 3, n, n, n, n, n, n,
                                              n, n, n, n, n, n, n, n),
                             _mm256_setr_epi8(2, 5, 8, 11, 14, n, n, n, n, n, n, n, n, n, n, n, 1, 4, n, n, n, n, n, n,
                                              n, n, n, n, n, n, n, n)};
    return pick[c];
  }
  __m256i sums_[3] = {_mm256_setzero_si256(), _mm256_setzero_si256(), _mm256_setzero_si256()};
};
#endif

/// Sum of the colours of a window's pixels that are set. radius: at most 3.
Mean mean_of(const BitMask& mask, const Image& rgb, int x, int y, int radius) {
  Mean mean;
  const int x0 = std::max(0, x - radius), x1 = std::min(mask.width - 1, x + radius);
  const int y0 = std::max(0, y - radius), y1 = std::min(mask.height - 1, y + radius);
  const auto window_of = [&](int v) {
    const std::uint64_t* row = mask.row(v);
    std::uint64_t window = row[x0 >> 6] >> (x0 & 63);
    if ((x0 >> 6) != (x1 >> 6)) window |= row[x1 >> 6] << (64 - (x0 & 63));
    return window & ((std::uint64_t(1) << (x1 - x0 + 1)) - 1);
  };
#ifdef __AVX2__
  // 32 bytes of a row are read: of the picture's last row, too.
  if (y1 + 1 < mask.height || 3 * x0 + 32 <= 3 * mask.width) {
    ChannelSums sums;
    for (int v = y0; v <= y1; ++v) {
      const std::uint64_t window = window_of(v);
      if (window == 0) continue;
      mean.count += std::popcount(window);
      sums.add(rgb.row<std::uint8_t>(v) + 3 * x0, window);
    }
    for (std::size_t c = 0; c < 3; ++c) mean.sum[c] = sums.sum(c);
    return mean;
  }
#endif
  for (int v = y0; v <= y1; ++v) {
    std::uint64_t window = window_of(v);
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

void soften(const BitMask& decisions, const Image& rgb, EdgeMode mode, bool on_edges, Image& out) {
  // The uniform foreground makes nearly every mixed colour object: the band that is not to be trusted lies mostly on
  // the object's side of the boundary. Where that is on the edges already, colours are taken from close by: a shiny
  // object's rim mirrors what is behind it, and those from farther in would make the object too small.
  const int radius = on_edges ? kClose : kWide;
  const BitMask background = complement(decisions);
  const BitMask sure_background = eroded(background, false);
  const BitMask narrow_object = eroded(decisions, false);
  const BitMask sure_object = on_edges ? narrow_object : eroded(eroded(decisions, true), false);
  for (int y = 0; y < decisions.height; ++y) {
    std::uint8_t* alpha = out.row<std::uint8_t>(y);
    const std::uint8_t* pixels = rgb.row<std::uint8_t>(y);
    for (int w = 0; w < decisions.words; ++w) {
      const std::uint64_t object = decisions.row(y)[w];
      const std::uint64_t trusted_object = mode == EdgeMode::matte ? sure_object.row(y)[w] : narrow_object.row(y)[w];
      std::uint64_t edge = (object & ~trusted_object) | (background.row(y)[w] & ~sure_background.row(y)[w]);
      for (; edge; edge &= edge - 1) {
        const int x = 64 * w + std::countr_zero(edge);
        const Mean b = mean_of(sure_background, rgb, x, y, radius);
        if (b.count == 0) continue;
        Mean f = mean_of(sure_object, rgb, x, y, radius);
        if (f.count == 0) f = mean_of(narrow_object, rgb, x, y, radius);
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
