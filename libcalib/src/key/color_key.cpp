#include <lumihull/base/error.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "color_key_impl.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace lumihull::calib {
namespace {

std::uint32_t code(Rgb c) { return std::uint32_t(c[0]) << 16 | std::uint32_t(c[1]) << 8 | c[2]; }

std::uint64_t total(std::span<const ColorCount> colors) {
  std::uint64_t sum = 0;
  for (const ColorCount& c : colors) sum += c.count;
  return sum;
}

/// Ascending, each colour once, none with count zero.
std::vector<ColorCount> merged(std::span<const ColorCount> colors) {
  std::vector<ColorCount> sorted(colors.begin(), colors.end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return code(a.color) < code(b.color); });
  std::vector<ColorCount> out;
  for (const ColorCount& c : sorted) {
    if (c.count == 0) continue;
    if (!out.empty() && out.back().color == c.color)
      out.back().count += c.count;
    else
      out.push_back(c);
  }
  return out;
}

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::invalid_argument, message, "colour key"); }

/// SplitMix64 (Steele, Lea & Flood 2014): the same numbers with every standard library.
std::uint64_t next_random(std::uint64_t& state) {
  std::uint64_t z = state += 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

}  // namespace

std::vector<ColorCount> count_colors(std::span<const Rgb> colors) {
  std::vector<std::uint32_t> codes(colors.size());
  std::transform(colors.begin(), colors.end(), codes.begin(), code);
  std::sort(codes.begin(), codes.end());
  std::vector<ColorCount> out;
  for (std::size_t i = 0, j = 0; i < codes.size(); i = j) {
    while (j < codes.size() && codes[j] == codes[i]) ++j;
    const std::uint32_t c = codes[i];
    out.push_back({{std::uint8_t(c >> 16), std::uint8_t(c >> 8), std::uint8_t(c)}, std::uint32_t(j - i)});
  }
  return out;
}

void ColorKeyOptions::validate() const {
  if (k < 1 || k > kMaxNeighbours) fail("k: expected 1 to " + std::to_string(kMaxNeighbours));
  if (!(foreground_share > 0 && foreground_share <= 100))
    fail("foreground share: expected a number above 0, at most 100");
}

ColorKey::ColorKey(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)), table_(impl_->table.data()) {}

ColorKey ColorKey::train(std::span<const Rgb> background, const ColorKeyOptions& options, Job& job) {
  options.validate();
  if (background.empty()) fail("expected background samples");
  if (background.size() > kMaxKeySamples) fail("expected at most " + std::to_string(kMaxKeySamples) + " samples");
  const std::size_t n = std::max<std::size_t>(
      std::size_t(std::llround(options.foreground_share * double(background.size()))), std::size_t(options.k));
  if (n > kMaxKeySamples)
    fail("foreground share: expected at most " + std::to_string(kMaxKeySamples) + " samples in all");
  std::vector<Rgb> foreground(n);
  std::uint64_t state = options.seed;
  for (Rgb& c : foreground) {
    const std::uint64_t r = next_random(state);
    c = {std::uint8_t(r >> 56), std::uint8_t(r >> 48), std::uint8_t(r >> 40)};
  }
  return train(count_colors(background), count_colors(foreground), options.k, job);
}

ColorKey ColorKey::train(std::span<const ColorCount> background, std::span<const ColorCount> foreground, int k,
                         Job& job) {
  if (k < 1 || k > kMaxNeighbours) fail("k: expected 1 to " + std::to_string(kMaxNeighbours));
  const std::uint64_t b = total(background), f = total(foreground);
  if (b == 0) fail("expected background samples");
  if (f == 0) fail("expected foreground samples");
  if (b > kMaxKeySamples || f > kMaxKeySamples)
    fail("expected at most " + std::to_string(kMaxKeySamples) + " samples of a kind");
  if (b + f < std::uint64_t(k)) fail("expected at least k = " + std::to_string(k) + " samples");
  auto impl = std::make_shared<Impl>();
  impl->k = k;
  impl->background = merged(background);
  impl->foreground = merged(foreground);
  impl->table = build_color_table(impl->background, impl->foreground, k, job);
  impl->near_background = SampleGrid(impl->background);
  impl->near_foreground = SampleGrid(impl->foreground);
  return ColorKey(std::move(impl));
}

int ColorKey::k() const noexcept { return impl_->k; }
std::span<const ColorCount> ColorKey::background() const noexcept { return impl_->background; }
std::span<const ColorCount> ColorKey::foreground() const noexcept { return impl_->foreground; }
std::span<const std::uint64_t> ColorKey::table() const noexcept { return impl_->table; }

Rgb ColorKey::background_median() const noexcept {
  Rgb median{};
  const std::uint64_t half = (total(impl_->background) + 1) / 2;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::array<std::uint64_t, 256> histogram{};
    for (const ColorCount& c : impl_->background) histogram[c.color[channel]] += c.count;
    std::uint64_t seen = 0;
    for (int v = 0; v < 256; ++v) {
      seen += histogram[std::size_t(v)];
      if (seen < half) continue;
      median[channel] = std::uint8_t(v);
      break;
    }
  }
  return median;
}

int ColorKey::foreground_neighbours(Rgb color) const {
  // Squared distances of the k nearest of each kind, ascending; merged, the background first at equal distance.
  const int k = impl_->k;
  constexpr int kAnywhere = 3 * 255 * 255;
  const std::vector<int> f = impl_->near_foreground.nearest(color, k, kAnywhere);
  const std::vector<int> b = impl_->near_background.nearest(color, k, int(f.size()) == k ? f.back() : kAnywhere);
  std::size_t i = 0, j = 0;
  while (int(i + j) < k) {
    if (j == f.size() || (i < b.size() && b[i] <= f[j]))
      ++i;
    else
      ++j;
  }
  return int(j);
}

SampleGrid::SampleGrid(std::span<const ColorCount> colors) {
  const auto cell = [](Rgb c) { return std::size_t(c[0] >> 3) << 10 | std::size_t(c[1] >> 3) << 5 | c[2] >> 3; };
  first_.assign(kCells + 1, 0);
  for (const ColorCount& c : colors) ++first_[cell(c.color) + 1];
  for (std::size_t i = 0; i < kCells; ++i) first_[i + 1] += first_[i];
  colors_.resize(colors.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (const ColorCount& c : colors) colors_[next[cell(c.color)]++] = c;
}

std::vector<int> SampleGrid::nearest(Rgb color, int n, int limit) const {
  std::vector<int> best;
  best.reserve(std::size_t(n) + 1);
  const auto look_at = [&](const ColorCount& sample) {
    const int dx = sample.color[0] - color[0], dy = sample.color[1] - color[1], dz = sample.color[2] - color[2];
    const int d = dx * dx + dy * dy + dz * dz;
    if (d > limit) return;
    for (std::uint32_t c = sample.count; c > 0; --c) {
      if (int(best.size()) == n && d >= best.back()) break;
      best.insert(std::upper_bound(best.begin(), best.end(), d), d);
      if (int(best.size()) > n) best.pop_back();
    }
  };
  constexpr std::size_t kFew = 512;
  if (colors_.size() <= kFew) {
    for (const ColorCount& sample : colors_) look_at(sample);
    return best;
  }
  const int home[3] = {color[0] >> 3, color[1] >> 3, color[2] >> 3};
  for (int shell = 0; shell < kSide; ++shell) {
    // Every colour in this shell of cells is at least 8 (shell - 1) + 1 away along some axis.
    const int gap = std::max(0, 8 * (shell - 1) + 1);
    if (gap * gap > limit || (int(best.size()) == n && best.back() <= gap * gap)) break;
    const auto low = [&](int axis) { return std::max(0, home[axis] - shell); };
    const auto high = [&](int axis) { return std::min(kSide - 1, home[axis] + shell); };
    for (int x = low(0); x <= high(0); ++x)
      for (int y = low(1); y <= high(1); ++y) {
        const bool face = std::abs(x - home[0]) == shell || std::abs(y - home[1]) == shell;
        for (int z = low(2); z <= high(2); ++z) {
          if (!face && std::abs(z - home[2]) != shell) continue;
          const std::size_t cell = std::size_t((x * kSide + y) * kSide + z);
          for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) look_at(colors_[i]);
        }
      }
  }
  return best;
}

void ColorKey::decide(const std::uint8_t* rgb, std::size_t pixels, std::uint64_t* bits) const noexcept {
  std::size_t i = 0;
#ifdef __AVX2__
  // Eight pixels at a time: bytes to 32-bit lanes (blue, green, red, 0), the address by two multiply-adds, one gather.
  const __m256i spread = _mm256_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1,  //
                                          0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1);
  const __m256i weights_block_bytes = _mm256_set1_epi32(0x00010120);  // bytes: red x 32, green x 1, blue x 1
  const __m256i weights_block_words = _mm256_set1_epi32(0x00010020);  // (red x 32 + green) x 32 + blue
  const __m256i weights_inner_bytes = _mm256_set1_epi32(0x00010108);
  const __m256i weights_inner_words = _mm256_set1_epi32(0x00010008);
  const __m256i high5 = _mm256_set1_epi32(0x001F1F1F), low3 = _mm256_set1_epi32(0x00070707);
  const __m256i low5 = _mm256_set1_epi32(31);
  const int* words = reinterpret_cast<const int*>(table_);
  // 28 bytes are read for 24: the last pixels go the plain way.
  for (; i + 64 + 2 <= pixels; i += 64) {
    std::uint64_t word = 0;
    for (int part = 0; part < 8; ++part) {
      const std::uint8_t* p = rgb + 3 * (i + std::size_t(part) * 8);
      const __m256i raw =
          _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p))),
                                  _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + 12)), 1);
      const __m256i v = _mm256_shuffle_epi8(raw, spread);
      const __m256i block =
          _mm256_madd_epi16(_mm256_maddubs_epi16(_mm256_and_si256(_mm256_srli_epi32(v, 3), high5), weights_block_bytes),
                            weights_block_words);
      const __m256i inner =
          _mm256_madd_epi16(_mm256_maddubs_epi16(_mm256_and_si256(v, low3), weights_inner_bytes), weights_inner_words);
      const __m256i index = _mm256_or_si256(_mm256_slli_epi32(block, 4), _mm256_srli_epi32(inner, 5));
      const __m256i found = _mm256_i32gather_epi32(words, index, 4);
      // The wanted bit to the sign: shift left by 31 - bit.
      const __m256i shift = _mm256_andnot_si256(inner, low5);
      const int eight = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_sllv_epi32(found, shift)));
      word |= std::uint64_t(std::uint32_t(eight)) << (8 * part);
    }
    bits[i >> 6] = word;
  }
#endif
  for (; i < pixels; ++i) {
    if ((i & 63) == 0) bits[i >> 6] = 0;
    bits[i >> 6] |= std::uint64_t(is_object({rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]})) << (i & 63);
  }
}

}  // namespace lumihull::calib
