#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lumihull::hull {

/// A piece of a silhouette's contour, in samples of its field.
struct Segment {
  float ax, ay, bx, by;
};

/// Squared distances to a contour at the samples around it. Only blocks of 8 x 8 samples that the band touches are
/// kept, each in 256 bytes: at the size of a photograph's contour that stays in the cache.
class DistanceBand {
 public:
  /// band: in samples. Samples are 0 … samples_x - 1, 0 … samples_y - 1.
  DistanceBand(std::span<const Segment> segments, float band, int samples_x, int samples_y);

  /// Exact below band²; anything not less than band² beyond.
  float at(int x, int y) const {
    const std::int32_t block = blocks_[std::size_t(y >> 3) * std::size_t(blocks_x_) + std::size_t(x >> 3)];
    return block < 0 ? std::numeric_limits<float>::max()
                     : squared_[std::size_t(block)][std::size_t((y & 7) * 8 + (x & 7))];
  }

 private:
  struct alignas(32) Block : std::array<float, 64> {};
  struct Range {
    int x0, x1, y0, y1;  // inclusive, empty where x0 > x1 or y0 > y1
  };
  Range samples_near(const Segment& s) const;
  void splat(const Segment& s);

  float band_;
  int samples_x_, samples_y_, blocks_x_;
  std::vector<std::int32_t> blocks_;  // index into squared_, or -1
  std::vector<Block> squared_;
};

}  // namespace lumihull::hull
