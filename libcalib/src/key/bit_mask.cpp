#include "bit_mask.h"

#include <bit>
#include <numeric>

#ifdef __AVX2__
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
  Image out = Image::uninitialized(width, height, 1);
  for (int y = 0; y < height; ++y) {
    const std::uint64_t* in = row(y);
    std::uint8_t* pixels = out.row<std::uint8_t>(y);
    int x = 0;
#ifdef __AVX2__
    // Each byte of 32 bits eight times, then its bit by lane.
    const __m256i spread = _mm256_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1,  //
                                            2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3);
    const __m256i lane_bit = _mm256_set1_epi64x(std::int64_t(0x8040201008040201u));
    for (; x + 32 <= width; x += 32) {
      const __m256i source = _mm256_set1_epi32(std::int32_t(std::uint32_t(in[x >> 6] >> (x & 63))));
      const __m256i own = _mm256_and_si256(_mm256_shuffle_epi8(source, spread), lane_bit);
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + x), _mm256_cmpeq_epi8(own, lane_bit));
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

namespace {

/// Whether both horizontal neighbours are set, for a row's words; `last` holds the last word, with what lies beyond the
/// picture set. Three loops, so that the middle one has neither branches nor ends.
void both_sides(const std::uint64_t* row, int words, std::uint64_t last, std::uint64_t* out) {
  const int end = words - 1;
  const auto sides = [](std::uint64_t before, std::uint64_t here, std::uint64_t after) {
    return (here << 1 | before >> 63) & (here >> 1 | after << 63);
  };
  constexpr std::uint64_t kBeyond = ~std::uint64_t(0);
  if (end == 0) {
    out[0] = sides(kBeyond, last, kBeyond);
    return;
  }
  out[0] = sides(kBeyond, row[0], end == 1 ? last : row[1]);
  for (int w = 1; w + 1 < end; ++w) out[w] = sides(row[w - 1], row[w], row[w + 1]);
  if (end > 1) out[end - 1] = sides(row[end - 2], row[end - 1], last);
  out[end] = sides(row[end - 1], last, kBeyond);
}

}  // namespace

BitMask eroded(const BitMask& mask, bool eight_neighbours) {
  BitMask out(mask.width, mask.height);
  const std::size_t words = std::size_t(mask.words);
  const std::uint64_t beyond = ~mask.last_word_mask();
  const std::vector<std::uint64_t> outside(words, ~std::uint64_t(0));
  // Of three rows, each judged once: are both sides of a pixel set?
  std::vector<std::uint64_t> sides[3];
  for (auto& s : sides) s = outside;
  const auto judge = [&](int y) {
    both_sides(mask.row(y), mask.words, mask.row(y)[words - 1] | beyond, sides[(y + 3) % 3].data());
  };
  judge(0);
  for (int y = 0; y < mask.height; ++y) {
    const bool below = y + 1 < mask.height;
    if (below) judge(y + 1);
    const std::uint64_t* here = mask.row(y);
    const std::uint64_t* up = y > 0 ? mask.row(y - 1) : outside.data();
    const std::uint64_t* down = below ? mask.row(y + 1) : outside.data();
    const std::uint64_t* side = sides[y % 3].data();
    std::uint64_t* to = out.row(y);
    for (std::size_t w = 0; w < words; ++w) to[w] = here[w] & side[w] & up[w] & down[w];
    if (!eight_neighbours) continue;
    const std::uint64_t* up_side = y > 0 ? sides[(y + 2) % 3].data() : outside.data();
    const std::uint64_t* down_side = below ? sides[(y + 1) % 3].data() : outside.data();
    for (std::size_t w = 0; w < words; ++w) to[w] &= up_side[w] & down_side[w];
  }
  return out;
}

void clean(BitMask& mask, int smallest_object_px, int largest_hole_px) {
  if (smallest_object_px > 1) flip_small(mask, true, true, smallest_object_px - 1, true);
  if (largest_hole_px > 0) flip_small(mask, false, false, largest_hole_px, false);
}

}  // namespace lumihull::calib
