// Exact counts of colours, and an even choice among them.
#include <lumihull/base/error.h>
#include <lumihull/calib/background.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <limits>

namespace lumihull::calib {
namespace {

constexpr std::size_t kColors = std::size_t(1) << 24;

/// Interleaves the bits of the channels: neighbours along this order are near each other in the cube.
std::uint32_t morton(Rgb c) {
  std::uint32_t m = 0;
  for (int bit = 7; bit >= 0; --bit)
    m = m << 3 | (c[0] >> bit & 1u) << 2 | (c[1] >> bit & 1u) << 1 | (c[2] >> bit & 1u);
  return m;
}

}  // namespace

struct ColorHistogram::Impl {
  std::vector<std::uint32_t> counts = std::vector<std::uint32_t>(kColors, 0);
};

ColorHistogram::ColorHistogram() : impl_(std::make_unique<Impl>()) {}
ColorHistogram::ColorHistogram(ColorHistogram&&) noexcept = default;
ColorHistogram& ColorHistogram::operator=(ColorHistogram&&) noexcept = default;
ColorHistogram::~ColorHistogram() = default;

void ColorHistogram::add(Rgb c) noexcept {
  std::atomic_ref<std::uint32_t> count(
      impl_->counts[std::size_t(c[0]) << 16 | std::size_t(c[1]) << 8 | std::size_t(c[2])]);
  if (count.load(std::memory_order_relaxed) < std::numeric_limits<std::uint32_t>::max() / 2)
    count.fetch_add(1, std::memory_order_relaxed);
}

void ColorHistogram::add_pixels(const Image& photo, const Image* mask) {
  assert(photo.type() == PixelType::u8 && photo.channels() == 3);
  assert(!mask || (mask->width() == photo.width() && mask->height() == photo.height()));
  for (int y = 0; y < photo.height(); ++y) {
    const std::uint8_t* p = photo.row<std::uint8_t>(y);
    const std::uint8_t* m = mask ? mask->row<std::uint8_t>(y) : nullptr;
    for (int x = 0; x < photo.width(); ++x, p += 3)
      if (!m || m[x] == 0) add({p[0], p[1], p[2]});
  }
}

std::uint64_t ColorHistogram::total() const noexcept {
  std::uint64_t sum = 0;
  for (const std::uint32_t c : impl_->counts) sum += c;
  return sum;
}

std::vector<ColorCount> ColorHistogram::counts() const {
  std::vector<ColorCount> out;
  for (std::size_t i = 0; i < kColors; ++i)
    if (const std::uint32_t n = impl_->counts[i])
      out.push_back({{std::uint8_t(i >> 16), std::uint8_t(i >> 8), std::uint8_t(i)}, n});
  return out;
}

std::vector<ColorCount> subsample(std::span<const ColorCount> population, std::size_t at_most) {
  std::uint64_t total = 0;
  for (const ColorCount& c : population) total += c.count;
  std::vector<ColorCount> out(population.begin(), population.end());
  if (total <= at_most) return out;
  std::sort(out.begin(), out.end(),
            [](const ColorCount& a, const ColorCount& b) { return morton(a.color) < morton(b.color); });
  // Sample j stands at position floor((j + 1/2) total / at_most) of the population. Products stay exact: totals are
  // below 2^56 (2^24 colours of 2^32), so they are taken in 128 bits.
  std::uint64_t seen = 0, taken = 0;
  for (ColorCount& c : out) {
    seen += c.count;
    // Samples with (2 j + 1) total < 2 seen at_most.
    const auto until = std::uint64_t(((__uint128_t(2) * seen * at_most + total - 1) / total) / 2);
    const std::uint64_t upto = std::min<std::uint64_t>(until, at_most);
    c.count = std::uint32_t(upto - taken);
    taken = upto;
  }
  std::erase_if(out, [](const ColorCount& c) { return c.count == 0; });
  std::sort(out.begin(), out.end(), [](const ColorCount& a, const ColorCount& b) { return a.color < b.color; });
  return out;
}

}  // namespace lumihull::calib
