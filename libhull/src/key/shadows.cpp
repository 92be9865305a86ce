#include "shadows.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lumihull::hull {
namespace {

constexpr double kGrey = 0.01;     // squared saturation below which an enclosure has none
constexpr double kLess = 0.1;      // share of the background of a brightness that is not surely shadow
constexpr double kEnough = 200;    // pixels that tell
constexpr int kSaturations = 128;  // bins of saturation, a 32nd of the enclosure's each

}  // namespace

Shadows::Shadows(const calib::Rgb& background) {
  const int light = background[0] + background[1] + background[2];
  sure_.fill(INFINITY);
  if (light == 0) return;
  float square = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    hue_[c] = float(background[c]) / float(light) - 1.f / 3;
    square += hue_[c] * hue_[c];
  }
  if (square < kGrey) return;
  for (float& h : hue_) h /= square;
  brightest_ = light;
}

void Shadows::learn(std::span<const CoarseView> views, std::span<const Image> photos, const CoarseHull& hull,
                    Job& job) {
  if (brightest_ < 0) return;
  using Counts = std::vector<std::uint32_t>;
  std::vector<Counts> counted(views.size());
  parallel_for(job, views.size(), [&](std::size_t i) {
    const CoarseView& v = views[i];
    const Image near = hull.silhouette(v, hull.margin_px(v));
    Counts& counts = counted[i];
    counts.assign(std::size_t(kBins) * kSaturations, 0);
    for (int y = v.frame.y0; y < v.frame.y1; ++y) {
      const std::uint8_t *is_near = near.row<std::uint8_t>(y), *p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
      for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3) {
        const int light = p[0] + p[1] + p[2];
        if (is_near[x] || light > brightest_ || light < kDarkest) continue;
        const int bin = std::clamp(int(32 * saturation(p) / float(light)), 0, kSaturations - 1);
        ++counts[std::size_t(light / kBin) * kSaturations + std::size_t(bin)];
      }
    }
  });
  // From bright to dark: what is darker than all that was seen is at least as saturated.
  float sure = INFINITY;
  for (int bin = brightest_ / kBin; bin >= 0; --bin) {
    Counts counts(kSaturations, 0);
    double total = 0;
    for (const Counts& c : counted)
      for (std::size_t k = 0; k < kSaturations; ++k) {
        const std::uint32_t n = c[std::size_t(bin) * kSaturations + k];
        counts[k] += n, total += n;
      }
    if (total >= kEnough) {
      double left = kLess * total;
      std::size_t k = 0;
      while (k + 1 < kSaturations && (left -= counts[k]) > 0) ++k;
      sure = std::max(kLeast, float(k) / 32);
    }
    sure_[std::size_t(bin)] = sure;
  }
}

void Shadows::take(Image& mask, const Image& photo) const {
  if (brightest_ < 0) return;
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    const std::uint8_t* p = photo.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x, p += 3)
      if (row[x] >= 128 && may_be(p)) row[x] = 0;
  }
}

}  // namespace lumihull::hull
