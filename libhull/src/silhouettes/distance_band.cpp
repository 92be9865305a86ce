#include "distance_band.h"

#include <algorithm>
#include <cmath>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace lumihull::hull {

DistanceBand::DistanceBand(std::span<const Segment> segments, float band, int samples_x, int samples_y)
    : band_(band), samples_x_(samples_x), samples_y_(samples_y), blocks_x_((samples_x + 7) / 8) {
  blocks_.assign(std::size_t(blocks_x_) * std::size_t((samples_y + 7) / 8), -1);
  std::int32_t count = 0;
  for (const Segment& s : segments) {
    const Range r = samples_near(s);
    for (int y = r.y0 >> 3; y <= r.y1 >> 3; ++y)
      for (int x = r.x0 >> 3; x <= r.x1 >> 3; ++x) {
        std::int32_t& block = blocks_[std::size_t(y) * std::size_t(blocks_x_) + std::size_t(x)];
        if (block < 0) block = count++;
      }
  }
  Block far;
  far.fill(std::numeric_limits<float>::max());
  squared_.assign(std::size_t(count), far);
  for (const Segment& s : segments) splat(s);
}

DistanceBand::Range DistanceBand::samples_near(const Segment& s) const {
  return {std::max(int(std::ceil(std::min(s.ax, s.bx) - band_)), 0),
          std::min(int(std::floor(std::max(s.ax, s.bx) + band_)), samples_x_ - 1),
          std::max(int(std::ceil(std::min(s.ay, s.by) - band_)), 0),
          std::min(int(std::floor(std::max(s.ay, s.by) + band_)), samples_y_ - 1)};
}

void DistanceBand::splat(const Segment& s) {
  const Range r = samples_near(s);
  const float dx = s.bx - s.ax, dy = s.by - s.ay;
  const float length2 = dx * dx + dy * dy;
  const float inverse = length2 > 0 ? 1 / length2 : 0;
  // Lanes start at multiples of eight, so that the next segment reads back whole what this one wrote.
  for (int by = r.y0 >> 3; by <= r.y1 >> 3; ++by)
    for (int bx = r.x0 >> 3; bx <= r.x1 >> 3; ++bx) {
      float* const block =
          squared_[std::size_t(blocks_[std::size_t(by) * std::size_t(blocks_x_) + std::size_t(bx)])].data();
      const int y0 = std::max(r.y0, by * 8), y1 = std::min(r.y1, by * 8 + 7);
#ifdef __AVX2__
      const __m256 lanes = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
      const __m256 wx = _mm256_add_ps(_mm256_set1_ps(float(bx * 8) - s.ax), lanes);
      const __m256 across = _mm256_mul_ps(wx, _mm256_set1_ps(dx));
      for (int y = y0; y <= y1; ++y) {
        const float wy = float(y) - s.ay;
        __m256 t = _mm256_mul_ps(_mm256_add_ps(across, _mm256_set1_ps(wy * dy)), _mm256_set1_ps(inverse));
        t = _mm256_min_ps(_mm256_max_ps(t, _mm256_setzero_ps()), _mm256_set1_ps(1));
        const __m256 ex = _mm256_sub_ps(wx, _mm256_mul_ps(t, _mm256_set1_ps(dx)));
        const __m256 ey = _mm256_sub_ps(_mm256_set1_ps(wy), _mm256_mul_ps(t, _mm256_set1_ps(dy)));
        const __m256 d2 = _mm256_add_ps(_mm256_mul_ps(ex, ex), _mm256_mul_ps(ey, ey));
        float* const at = block + (y & 7) * 8;
        _mm256_store_ps(at, _mm256_min_ps(_mm256_load_ps(at), d2));
      }
#else
      for (int y = y0; y <= y1; ++y)
        for (int x = 0; x < 8; ++x) {
          const float wx = float(bx * 8) - s.ax + float(x), wy = float(y) - s.ay;
          const float t = std::clamp((wx * dx + wy * dy) * inverse, 0.0f, 1.0f);
          const float ex = wx - t * dx, ey = wy - t * dy;
          float& at = block[(y & 7) * 8 + x];
          at = std::min(at, ex * ex + ey * ey);
        }
#endif
    }
}

}  // namespace lumihull::hull
