#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace lumihull::calib {

/// An 8-bit sRGB colour: red, green, blue.
using Rgb = std::array<std::uint8_t, 3>;

/// How many times a colour occurs among the training samples.
struct ColorCount {
  Rgb color{};
  std::uint32_t count = 0;
};

inline constexpr int kMaxNeighbours = 255;
inline constexpr std::uint64_t kMaxKeySamples = 10'000'000;

struct LUMIHULL_API ColorKeyOptions {
  int k = 7;                      ///< neighbours asked, 1 … kMaxNeighbours
  double foreground_share = 0.2;  ///< foreground samples as a share of the background's, > 0; the paper's 20 %
  std::uint64_t seed = 1;         ///< of the uniform foreground samples

  /// Throws Error{invalid_argument} naming the option.
  void validate() const;
};

/// The paper's colour keyer (section 3.2): exact k nearest neighbours in integer RGB.
///
///     P(Y = 1 | x') = 1/k Σ_{x in N(x')} Y(x)                                                       (paper, eq. 9)
///
/// and a colour is object where more than half of its k nearest samples are foreground. N(x') is made unique by the
/// order (squared Euclidean distance, sample index), background samples standing before foreground samples: at equal
/// distance the background wins. A colour that occurs n times among the samples counts as n neighbours. Brute force
/// over the list of samples gives the same answer for every colour.
///
/// The decision for all 256³ colours is kept as a bit table of 2 MB. An immutable value; copies share the table; any
/// number of threads may ask.
class LUMIHULL_API ColorKey {
 public:
  /// Foreground samples uniform in the RGB cube, `foreground_share` times as many as the background's (rounded, at
  /// least k). The result does not depend on the samples' order nor on the number of threads.
  /// Errors: invalid_argument (options, fewer samples than k, more than kMaxKeySamples).
  static ColorKey train(std::span<const Rgb> background, const ColorKeyOptions& options, Job& job);

  /// Both kinds of samples given, e.g. a target's ink against the enclosure; repeated colours may be given apart.
  /// Errors: invalid_argument (k, a side without samples, fewer than k samples together).
  static ColorKey train(std::span<const ColorCount> background, std::span<const ColorCount> foreground, int k,
                        Job& job);

  int k() const noexcept;
  /// Training samples: colours in ascending order (red first), each once.
  std::span<const ColorCount> background() const noexcept;
  std::span<const ColorCount> foreground() const noexcept;

  /// Median of the background samples, channel by channel.
  Rgb background_median() const noexcept;

  /// Where the decision of a colour stands: bit (address & 63) of table()[address >> 6]. Blocks of 8 x 8 x 8 colours
  /// are 512 neighbouring bits, one cache line: a photograph's colours lie close together.
  static constexpr std::uint32_t address(Rgb c) noexcept {
    return std::uint32_t(c[0] >> 3) << 19 | std::uint32_t(c[1] >> 3) << 14 | std::uint32_t(c[2] >> 3) << 9 |
           std::uint32_t(c[0] & 7) << 6 | std::uint32_t(c[1] & 7) << 3 | std::uint32_t(c[2] & 7);
  }
  std::span<const std::uint64_t> table() const noexcept;

  bool is_object(Rgb color) const noexcept {
    const std::uint32_t a = address(color);
    return table_[a >> 6] >> (a & 63) & 1;
  }

  /// Decides pixels: bit (i & 63) of bits[i >> 6] is set where pixel i (red, green, blue bytes at rgb[3i]) is object;
  /// the bits beyond the last pixel of the last word are zero. bits: (pixels + 63) / 64 words.
  void decide(const std::uint8_t* rgb, std::size_t pixels, std::uint64_t* bits) const noexcept;

  /// Σ Y(x) of eq. 9: how many of the k nearest samples are foreground. Exact for any colour; searches the samples
  /// (microseconds).
  int foreground_neighbours(Rgb color) const;
  /// P(Y = 1 | colour) of eq. 9.
  double probability(Rgb color) const { return double(foreground_neighbours(color)) / k(); }

  /// One JSON file with the samples; loading rebuilds the table, so that it always agrees with them.
  /// Errors: io.
  void save(const std::filesystem::path& file) const;
  /// Errors: not_found, io, bad_input (names the file, the JSON pointer and what was expected).
  static ColorKey load(const std::filesystem::path& file, Job& job);

 private:
  struct Impl;
  explicit ColorKey(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;
  const std::uint64_t* table_;
};

/// Colours and their counts, ascending, each once.
LUMIHULL_API std::vector<ColorCount> count_colors(std::span<const Rgb> colors);

}  // namespace lumihull::calib
