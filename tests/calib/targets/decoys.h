#pragma once

// Pictures without targets, made to be mistaken for some.

#include <lumihull/base/image.h>

#include <cstdint>

namespace lumihull::test {

/// Noise, blotches, foliage, text, halftone dots, perforated sheets (4 x 4 to 6 x 6 holes among them), keyboards,
/// nested shapes: one kind a picture, by the seed, with blur and noise. 8 bits, 3 channels.
inline constexpr int kDecoyKinds = 8;
Image decoy(std::uint64_t seed, int width = 400, int height = 300);

}  // namespace lumihull::test
