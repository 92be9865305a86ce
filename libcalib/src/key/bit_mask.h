#pragma once

#include <lumihull/base/image.h>

#include <cstdint>
#include <vector>

namespace lumihull::calib {

/// A silhouette of one bit a pixel. Rows start at a word; bits beyond the width are zero.
struct BitMask {
  int width = 0, height = 0, words = 0;  ///< words of 64 pixels in a row
  std::vector<std::uint64_t> bits;

  BitMask(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        words((width_px + 63) / 64),
        bits(std::size_t(words) * std::size_t(height_px)) {}
  explicit BitMask(const Image& mask);  ///< 8 bits, 1 channel; set where >= 128

  std::uint64_t* row(int y) { return bits.data() + std::size_t(y) * std::size_t(words); }
  const std::uint64_t* row(int y) const { return bits.data() + std::size_t(y) * std::size_t(words); }
  bool at(int x, int y) const { return row(y)[x >> 6] >> (x & 63) & 1; }
  /// The set bits among the last word's that are pixels.
  std::uint64_t last_word_mask() const {
    return (width & 63) ? (std::uint64_t(1) << (width & 63)) - 1 : ~std::uint64_t(0);
  }

  Image expanded() const;  ///< 0 and 255
};

/// Pixels that are set together with all neighbours (4-neighbours, or all 8). What is outside the picture counts as
/// set.
BitMask eroded(const BitMask& mask, bool eight_neighbours);
BitMask complement(const BitMask& mask);

/// As clean_mask.
void clean(BitMask& mask, int smallest_object_px, int largest_hole_px);

}  // namespace lumihull::calib
