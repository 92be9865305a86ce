#include "bit_mask.h"

#include <bit>
#include <cstring>
#include <numeric>

#if defined(__BMI2__) || defined(__AVX2__)
#include <immintrin.h>
#endif

namespace lumihull::calib {
namespace {

/// Horizontal run of one kind of pixel.
struct Run {
  int y, first, last;  ///< columns first … last
};

/// Area and contact with the picture's border of connected runs.
class Components {
 public:
  explicit Components(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    if (a < b) parent_[b] = a;
    if (b < a) parent_[a] = b;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// All runs of pixels that are `set`, row by row; first_in_row[y] … first_in_row[y + 1].
std::vector<Run> runs_of(const BitMask& mask, bool set, std::vector<std::uint32_t>& first_in_row) {
  std::vector<Run> runs;
  first_in_row.clear();
  for (int y = 0; y < mask.height; ++y) {
    first_in_row.push_back(std::uint32_t(runs.size()));
    const std::uint64_t* row = mask.row(y);
    int start = -1;
    for (int w = 0; w < mask.words; ++w) {
      std::uint64_t bits = set ? row[w] : ~row[w];
      if (w == mask.words - 1) bits &= mask.last_word_mask();
      // Changes between neighbouring pixels, the pixel before the word included.
      std::uint64_t changes = bits ^ (bits << 1 | std::uint64_t(start >= 0));
      while (changes) {
        const int x = w * 64 + std::countr_zero(changes);
        changes &= changes - 1;
        if (start < 0) {
          start = x;
        } else {
          runs.push_back({y, start, x - 1});
          start = -1;
        }
      }
    }
    if (start >= 0) runs.push_back({y, start, mask.width - 1});
  }
  first_in_row.push_back(std::uint32_t(runs.size()));
  return runs;
}

/// Flips components of `set` pixels whose area is at most `area`; those at the border only if `border_too`.
void flip_small(BitMask& mask, bool set, bool diagonal, int area, bool border_too) {
  std::vector<std::uint32_t> first_in_row;
  const std::vector<Run> runs = runs_of(mask, set, first_in_row);
  Components components(runs.size());
  const int reach = diagonal ? 1 : 0;
  for (int y = 1; y < mask.height; ++y) {
    std::uint32_t a = first_in_row[std::size_t(y) - 1], b = first_in_row[std::size_t(y)];
    const std::uint32_t a_end = b, b_end = first_in_row[std::size_t(y) + 1];
    while (a < a_end && b < b_end) {
      if (runs[a].first <= runs[b].last + reach && runs[b].first <= runs[a].last + reach) components.join(a, b);
      if (runs[a].last < runs[b].last)
        ++a;
      else
        ++b;
    }
  }
  std::vector<std::int64_t> areas(runs.size());
  for (std::uint32_t i = 0; i < runs.size(); ++i) {
    const Run& r = runs[i];
    std::int64_t& total = areas[components.find(i)];
    total += r.last - r.first + 1;
    const bool border = r.y == 0 || r.y == mask.height - 1 || r.first == 0 || r.last == mask.width - 1;
    if (border && !border_too) total += std::int64_t(1) << 40;
  }
  for (std::uint32_t i = 0; i < runs.size(); ++i) {
    if (areas[components.find(i)] > area) continue;
    std::uint64_t* row = mask.row(runs[i].y);
    for (int x = runs[i].first; x <= runs[i].last; ++x) row[x >> 6] ^= std::uint64_t(1) << (x & 63);
  }
}

}  // namespace

BitMask::BitMask(const Image& mask) : BitMask(mask.width(), mask.height()) {
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* in = mask.row<std::uint8_t>(y);
    std::uint64_t* out = row(y);
    int x = 0;
#ifdef __AVX2__
    for (; x + 32 <= width; x += 32) {
      const __m256i pixels = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(in + x));
      out[x >> 6] |= std::uint64_t(std::uint32_t(_mm256_movemask_epi8(pixels))) << (x & 63);
    }
#endif
    for (; x < width; ++x) out[x >> 6] |= std::uint64_t(in[x] >> 7) << (x & 63);
  }
}

Image BitMask::expanded() const {
  Image out(width, height, 1);
  for (int y = 0; y < height; ++y) {
    const std::uint64_t* in = row(y);
    std::uint8_t* pixels = out.row<std::uint8_t>(y);
    int x = 0;
#ifdef __BMI2__
    for (; x + 8 <= width; x += 8) {
      const std::uint64_t eight = in[x >> 6] >> (x & 63) & 0xFF;
      const std::uint64_t bytes = _pdep_u64(eight, 0x0101010101010101u) * 255;
      std::memcpy(pixels + x, &bytes, 8);
    }
#endif
    for (; x < width; ++x) pixels[x] = (in[x >> 6] >> (x & 63) & 1) ? 255 : 0;
  }
  return out;
}

BitMask complement(const BitMask& mask) {
  BitMask out(mask.width, mask.height);
  for (int y = 0; y < mask.height; ++y) {
    for (int w = 0; w < mask.words; ++w) out.row(y)[w] = ~mask.row(y)[w];
    out.row(y)[mask.words - 1] &= mask.last_word_mask();
  }
  return out;
}

BitMask eroded(const BitMask& mask, bool eight_neighbours) {
  BitMask out(mask.width, mask.height);
  const int last = mask.words - 1;
  // A word of row y, and the same moved by one pixel to the left and right.
  const auto word = [&](int y, int w) {
    if (y < 0 || y >= mask.height || w < 0 || w > last) return ~std::uint64_t(0);
    return w == last ? mask.row(y)[w] | ~mask.last_word_mask() : mask.row(y)[w];
  };
  const auto sides = [&](int y, int w) {
    const std::uint64_t here = word(y, w);
    return (here << 1 | word(y, w - 1) >> 63) & (here >> 1 | word(y, w + 1) << 63);
  };
  for (int y = 0; y < mask.height; ++y) {
    for (int w = 0; w < mask.words; ++w) {
      std::uint64_t bits = word(y, w) & sides(y, w) & word(y - 1, w) & word(y + 1, w);
      if (eight_neighbours) bits &= sides(y - 1, w) & sides(y + 1, w);
      out.row(y)[w] = w == last ? bits & mask.last_word_mask() : bits;
    }
  }
  return out;
}

void clean(BitMask& mask, int smallest_object_px, int largest_hole_px) {
  if (smallest_object_px > 1) flip_small(mask, true, true, smallest_object_px - 1, true);
  if (largest_hole_px > 0) flip_small(mask, false, false, largest_hole_px, false);
}

}  // namespace lumihull::calib
