#include "bayer.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace lumihull::rig {

Image through_bayer(const Image& image, bool clip) {
  const int w = image.width(), h = image.height();
  const auto color_at = [](int x, int y) { return (y & 1) + (x & 1); };  // 0 red, 1 green, 2 blue
  const auto value = [&](int x, int y, int c) {
    const float v = image.row<float>(y)[3 * x + c];
    return clip ? std::clamp(v, 0.f, 1.f) : v;
  };
  Image result(w, h, 3, PixelType::f32);
  for (int y = 0; y < h; ++y) {
    float* out = result.row<float>(y);
    for (int x = 0; x < w; ++x, out += 3) {
      const int own = color_at(x, y);
      std::array<float, 3> sum{}, weight{};
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int u = x + dx, v = y + dy;
          if (u < 0 || v < 0 || u >= w || v >= h) continue;
          const int c = color_at(u, v);
          // Green lacks at red and blue places and has four neighbours beside it; its own diagonals do not count.
          if (c == own && (dx != 0 || dy != 0)) continue;
          sum[std::size_t(c)] += value(u, v, c), weight[std::size_t(c)] += 1;
        }
      for (std::size_t c = 0; c < 3; ++c) out[c] = weight[c] > 0 ? sum[c] / weight[c] : sum[std::size_t(own)];
    }
  }
  return result;
}

}  // namespace lumihull::rig
