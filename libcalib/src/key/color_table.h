#pragma once

#include <lumihull/calib/color_key.h>

#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::calib {

/// The exact decision for all 256³ colours; bit order: ColorKey::address. Samples as ColorKey describes them, at least
/// k together.
std::vector<std::uint64_t> build_color_table(std::span<const ColorCount> background,
                                             std::span<const ColorCount> foreground, int k, Job& job);

}  // namespace lumihull::calib
