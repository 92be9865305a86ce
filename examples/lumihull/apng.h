#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull::program {

/// Frames as an animated PNG that plays for ever (APNG 1.0; any browser shows it, other viewers its first frame).
/// frames: PNG files of one size and pixel format, at least one. delay_ms: of each frame, 1 … 60000.
/// Errors: bad_input (a file that is no PNG, or differs in size or format from the first), invalid_argument.
std::string animated_png(std::span<const std::string> frames, int delay_ms);

}  // namespace lumihull::program
