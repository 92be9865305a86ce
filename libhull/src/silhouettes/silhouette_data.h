#pragma once

// How a silhouette's field lies in memory, and the two questions that carving asks it.

#include <lumihull/hull/silhouette.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lumihull::hull {

inline constexpr int kTile = 8;  // cells along a tile's side
inline constexpr int kTileSamples = kTile + 1;
inline constexpr std::int16_t kDeep = 32000;  // the band's end: samples beyond it hold exactly ±kDeep
inline constexpr std::int16_t kUnseen = -32768;

/// What the cells of a region of the field are; bits.
enum CellState : std::uint8_t {
  kDeepInside = 1,   // all samples beyond the band, inside
  kDeepOutside = 2,  // the same, outside
  kNotSeen = 4,      // not wholly inside the picture
  kBand = 8,         // anything else
};

/// 8 x 8 cells with all their corners, so that interpolation never leaves a tile.
struct alignas(64) Tile {
  std::array<std::int16_t, kTileSamples * kTileSamples> samples;
  // Bit 8 y + x of each: cell (x, y) is in that state; a cell in none of them is in the band.
  std::uint64_t deep_inside, deep_outside, not_seen;
};
static_assert(sizeof(Tile) == 192);
inline constexpr int kTileStride = sizeof(Tile) / sizeof(std::int16_t);

/// Tiles that many silhouettes' directories would repeat.
enum : std::int32_t { kInsideTile = 0, kOutsideTile = 1, kUnseenTile = 2, kFirstTile = 3 };

struct Silhouette::Data {
  double cell = 0;                                   // ideal plane
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // ideal plane, of sample (0, 0)
  double quantum = 0;                                // ideal plane: distance of a sample's value 1
  int tiles_x = 0, tiles_y = 0;
  std::vector<std::int32_t> directory;  // tiles_y x tiles_x
  std::vector<Tile> tiles;
  std::vector<std::vector<std::uint8_t>> pyramid;  // CellState bits; level 0: tiles; each level halves both sides
  int seen_x0 = 0, seen_y0 = 0, seen_x1 = -1, seen_y1 = -1;  // cells, inclusive: a rectangle without unseen cells
  bool empty = false, full = false;
  SilhouetteBounds bounds;

  int cells_x() const { return tiles_x * kTile; }
  int cells_y() const { return tiles_y * kTile; }

  /// Bits of all cells in [x0, x1] x [y0, y1], or of more around them. Where the rectangle is free of unseen cells and
  /// the answer can't be one state alone, the rest may be missing.
  std::uint8_t query(int x0, int y0, int x1, int y1) const {
    std::uint8_t bits = 0;
    if (x0 < 0 || y0 < 0 || x1 >= cells_x() || y1 >= cells_y()) {
      bits = kNotSeen;
      x0 = std::max(x0, 0), y0 = std::max(y0, 0);
      x1 = std::min(x1, cells_x() - 1), y1 = std::min(y1, cells_y() - 1);
      if (x0 > x1 || y0 > y1) return bits;
    }
    const bool seen = bits == 0 && x0 >= seen_x0 && x1 <= seen_x1 && y0 >= seen_y0 && y1 <= seen_y1;
    const auto decided = [&] { return seen && (bits & (bits - 1) || bits & kBand); };
    int tx0 = x0 / kTile, tx1 = x1 / kTile, ty0 = y0 / kTile, ty1 = y1 / kTile;
    if (tx1 - tx0 < 4 && ty1 - ty0 < 4) {
      for (int ty = ty0; ty <= ty1; ++ty)
        for (int tx = tx0; tx <= tx1; ++tx) {
          const std::size_t t = std::size_t(ty) * tiles_x + tx;
          std::uint8_t state = pyramid[0][t];
          if (state & (state - 1) || state == kBand) {
            const int cx0 = std::max(x0 - tx * kTile, 0), cx1 = std::min(x1 - tx * kTile, kTile - 1);
            const int cy0 = std::max(y0 - ty * kTile, 0), cy1 = std::min(y1 - ty * kTile, kTile - 1);
            const std::uint64_t row = (0xFFu >> (kTile - 1 - (cx1 - cx0))) << cx0;
            const std::uint64_t cells =
                (row * 0x0101010101010101u) & (~std::uint64_t(0) >> (8 * (kTile - 1 - (cy1 - cy0)))) << (8 * cy0);
            const Tile& tile = tiles[std::size_t(directory[t])];
            state =
                std::uint8_t((cells & tile.deep_inside ? kDeepInside : 0) |
                             (cells & tile.deep_outside ? kDeepOutside : 0) | (cells & tile.not_seen ? kNotSeen : 0) |
                             (cells & ~(tile.deep_inside | tile.deep_outside | tile.not_seen) ? kBand : 0));
          }
          bits |= state;
          if (decided()) return bits;
        }
      return bits;
    }
    int level = 0;
    while (tx1 - tx0 >= 4 || ty1 - ty0 >= 4) tx0 >>= 1, tx1 >>= 1, ty0 >>= 1, ty1 >>= 1, ++level;
    const int width = ((tiles_x - 1) >> level) + 1;
    const std::vector<std::uint8_t>& states = pyramid[std::size_t(level)];
    for (int ty = ty0; ty <= ty1; ++ty)
      for (int tx = tx0; tx <= tx1; ++tx) {
        bits |= states[std::size_t(ty) * width + tx];
        if (decided()) return bits;
      }
    return bits;
  }

  /// The field at (u, v), in cells from sample (0, 0), as a multiple of the quantum. NaN where the picture says
  /// nothing.
  double sample(double u, double v) const {
    if (!(u >= 0 && v >= 0 && u < cells_x() && v < cells_y())) return NAN;
    const int x = int(u), y = int(v);
    const Tile& tile = tiles[std::size_t(directory[std::size_t(y / kTile) * tiles_x + x / kTile])];
    const std::int16_t* s = &tile.samples[std::size_t(y % kTile) * kTileSamples + x % kTile];
    const std::int16_t a = s[0], b = s[1], c = s[kTileSamples], d = s[kTileSamples + 1];
    if (a == kUnseen || b == kUnseen || c == kUnseen || d == kUnseen) return NAN;
    const double fu = u - x, fv = v - y;
    const double top = a + fu * (b - a), bottom = c + fu * (d - c);
    return top + fv * (bottom - top);
  }
};

}  // namespace lumihull::hull
