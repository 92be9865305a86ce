#pragma once

#include <lumihull/base/image.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lumihull::test {

/// Pictures without targets. From harmless to those that a detector of discs and squares likes best.
enum class Clutter : std::uint8_t {
  white_noise,
  pink_noise,   ///< amplitude ~ 1 / frequency, grey or coloured
  salt,         ///< specks of a few pixels, black and white
  strokes,      ///< random strokes, arcs, blots
  text,         ///< lines of print in several fonts, from letters of 5 px; O, 0, 8 and @ in rows and columns among them
  leaves,       ///< ellipses and leaf shapes in greens, one over the other
  halftone,     ///< a screen of dots whose size follows a picture
  perforated,   ///< a sheet with a lattice of even discs, rings, or holes of which some lack, under perspective
  tiles,        ///< chessboards, grids, windows, barcodes, squares in squares
  photographs,  ///< crops of real photographs, mirrored, turned, blurred, their contrast changed
};
inline constexpr int kClutterKinds = 10;
std::string clutter_name(Clutter kind);

/// A picture, 8-bit RGB, about size x size. photographs: real ones to take crops from; needed for that kind alone.
Image clutter(Clutter kind, int size, std::uint64_t seed, std::span<const Image> photographs = {});

}  // namespace lumihull::test
