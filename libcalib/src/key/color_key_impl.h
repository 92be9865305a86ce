#pragma once

#include <lumihull/calib/color_key.h>

#include <vector>

#include "color_table.h"

namespace lumihull::calib {

/// Samples by cells of 8 x 8 x 8 colours, for asking single colours.
class SampleGrid {
 public:
  SampleGrid() = default;
  explicit SampleGrid(std::span<const ColorCount> colors);

  /// Squared distances to the n nearest samples (counts included) that are at most `limit`, ascending.
  std::vector<int> nearest(Rgb color, int n, int limit) const;

 private:
  static constexpr int kSide = 32;
  static constexpr std::size_t kCells = std::size_t(kSide) * kSide * kSide;
  std::vector<ColorCount> colors_;
  std::vector<std::uint32_t> first_;
};

struct ColorKey::Impl {
  int k = 0;
  std::vector<ColorCount> background, foreground;
  std::vector<std::uint64_t> table;
  SampleGrid near_background, near_foreground;
};

}  // namespace lumihull::calib
