#include "paper_colors.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <utility>

namespace lumihull::hull {
namespace {

constexpr int kDark = 48;          // red + green + blue below which a colour has no hue to speak of
constexpr double kMoreOften = 2;   // paper's colours are so much commoner on sheets than beside them
constexpr double kLeastCount = 2;  // pixels that must have a colour, for its hue not to be asked instead
constexpr int kClipped = 248;      // a colour whose every channel reaches it has no hue either

/// How often colours occur, in bins of 8 levels, and their hues and saturations, whatever their brightness. Each bin
/// counts its neighbours, too.
class Palette {
 public:
  Palette() : colors_(kBins * kBins * kBins, 0), chromas_(kBins * kBins, 0) {}

  void add(const std::uint8_t* rgb) {
    ++colors_[color_bin(rgb)];
    ++total_;
    if (const auto bin = chroma_bin(rgb)) ++chromas_[*bin];
  }
  void add(const Palette& other) {
    for (std::size_t i = 0; i < colors_.size(); ++i) colors_[i] += other.colors_[i];
    for (std::size_t i = 0; i < chromas_.size(); ++i) chromas_[i] += other.chromas_[i];
    total_ += other.total_;
  }
  /// Binomial weights 1 2 1 along each axis. Afterwards counts are for reading only.
  void smooth() {
    for (const std::size_t step : {1, kBins, kBins * kBins}) smooth(colors_, step);
    for (const std::size_t step : {1, kBins}) smooth(chromas_, step);
  }
  double color(const std::uint8_t* rgb) const { return colors_[color_bin(rgb)]; }
  double chroma(const std::uint8_t* rgb) const {
    const auto bin = chroma_bin(rgb);
    return bin ? chromas_[*bin] : 0;
  }
  double total() const { return total_; }

  static constexpr int kBins = 32;

 private:
  static std::size_t color_bin(const std::uint8_t* rgb) {
    return (std::size_t(rgb[0] >> 3) * kBins + std::size_t(rgb[1] >> 3)) * kBins + std::size_t(rgb[2] >> 3);
  }
  /// Nothing for dark colours: they have no hue to speak of.
  static std::optional<std::size_t> chroma_bin(const std::uint8_t* rgb) {
    const int sum = rgb[0] + rgb[1] + rgb[2];
    if (sum < kDark) return std::nullopt;
    return std::size_t((kBins - 1) * rgb[0] * 3 / 2 / sum % kBins) * kBins + std::size_t((kBins - 1) * rgb[1] / sum);
  }
  static void smooth(std::vector<float>& counts, std::size_t step) {
    std::vector<float> out(counts.size());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const std::size_t at = i / step % kBins;
      out[i] = (2 * counts[i] + (at > 0 ? counts[i - step] : 0) + (at + 1 < kBins ? counts[i + step] : 0)) / 4;
    }
    counts = std::move(out);
  }
  std::vector<float> colors_, chromas_;
  double total_ = 0;
};

}  // namespace

std::optional<PaperColors> PaperColors::learn(std::span<const Sheet> sheets, std::span<const CoarseView> views,
                                              std::span<const Image> photos, const CoarseHull& hull, Job& job) {
  std::vector<Palette> on(views.size()), beside(views.size());
  parallel_for(job, views.size(), [&](std::size_t i) {
    const CoarseView& v = views[i];
    const Image near = hull.silhouette(v, hull.margin_px(v)), parts = sheets_in(v, sheets);
    for (int y = v.frame.y0; y < v.frame.y1; ++y) {
      const std::uint8_t *is_near = near.row<std::uint8_t>(y), *part = parts.row<std::uint8_t>(y);
      const std::uint8_t* p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
      for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3)
        if (!is_near[x] && part[x] != kPaperRim) (part[x] == kPrint ? on : beside)[i].add(p);
    }
  });
  Palette sheet, rest;
  for (std::size_t i = 0; i < views.size(); ++i) sheet.add(on[i]), rest.add(beside[i]);
  if (sheet.total() == 0 || rest.total() == 0) return std::nullopt;
  sheet.smooth(), rest.smooth();
  PaperColors out;
  out.paper_.assign(64 * 64 * 64, 0);
  const double more = kMoreOften * sheet.total() / rest.total();
  for (int c = 0; c < int(out.paper_.size()); ++c) {
    const std::uint8_t rgb[3] = {std::uint8_t(4 * (c >> 12) + 2), std::uint8_t(4 * (c >> 6 & 63) + 2),
                                 std::uint8_t(4 * (c & 63) + 2)};
    const double s = sheet.color(rgb), r = rest.color(rgb);
    out.paper_[std::size_t(c)] = *std::min_element(rgb, rgb + 3) >= kClipped ||
                                 (s + r >= kLeastCount && s > more * r) || sheet.chroma(rgb) > more * rest.chroma(rgb);
  }
  return out;
}

}  // namespace lumihull::hull
