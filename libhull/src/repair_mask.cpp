#include "repair_mask.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lumihull::hull {
namespace {

constexpr std::size_t kLeastViews = 5;
constexpr int kResolution = 96;          // voxels a side
constexpr double kMistakenViews = 0.04;  // share of the views that bleed at the same place
constexpr int kSure = 3;                 // voxels below the hull's surface: no shaving is so thick
constexpr double kLeastSure = 5e-5;      // of the picture: so many pixels so deep make a patch
constexpr double kRare = 0.03;           // share of the background with colours that count as rare
constexpr int kWindow = 2;               // px; a pixel's neighbourhood decides with it
constexpr int kMostRounds = 4;
constexpr double kSettled = 2e-4;  // mended pixels of a round, as a share of the object's
constexpr int kBins = 64;          // of colours, a channel

/// A hull that forgives `kMistakenViews`, and one view at least.
std::optional<CoarseHull> carve_forgiving(std::span<const CoarseView> views, Job& job) {
  const double forgiven = std::max(1.0, std::floor(kMistakenViews * double(views.size()) + 0.5));
  return CoarseHull::carve(views, kResolution, (forgiven + 0.5) / double(views.size()), job);
}

/// Pixels as deep as kSure that make a patch.
std::size_t least_sure(const Image& mask) {
  return std::size_t(std::max(4.0, kLeastSure * mask.width() * mask.height()));
}

/// Sums of a window of (2 kWindow + 1)² pixels over an area, by running sums.
class WindowSum {
 public:
  WindowSum(int width, int height) : width_(width), sums_((std::size_t(width) + 1) * (std::size_t(height) + 1), 0) {}
  std::uint32_t& at(int x, int y) { return sums_[std::size_t(y) * (std::size_t(width_) + 1) + std::size_t(x)]; }

 private:
  int width_;
  std::vector<std::uint32_t> sums_;
};

}  // namespace

RareColors::RareColors(const Image& photo, const Image& outside) : density_(kBins * kBins * kBins, 0) {
  std::vector<std::uint32_t> count(density_.size(), 0);
  std::vector<std::uint32_t> occupied;
  double total = 0;
  for (int y = 0; y < photo.height(); ++y) {
    const std::uint8_t *p = photo.row<std::uint8_t>(y), *is_outside = outside.row<std::uint8_t>(y);
    for (int x = 0; x < photo.width(); ++x, p += 3) {
      if (!is_outside[x]) continue;
      const std::size_t b = bin(p);
      if (!count[b]++) occupied.push_back(std::uint32_t(b));
      ++total;
    }
  }
  // Binomial weights 1 2 1 along each axis, spread from the few bins that are occupied.
  for (const std::uint32_t b : occupied)
    for (int i = 0; i < 27; ++i) {
      const int r = int(b >> 12) + i / 9 - 1, g = int(b >> 6 & 63) + i / 3 % 3 - 1, bl = int(b & 63) + i % 3 - 1;
      if (std::min({r, g, bl}) < 0 || std::max({r, g, bl}) >= kBins) continue;
      const int weight = (i / 9 == 1 ? 2 : 1) * (i / 3 % 3 == 1 ? 2 : 1) * (i % 3 == 1 ? 2 : 1);
      density_[std::size_t((r << 12) | (g << 6) | bl)] += float(count[b]) * float(weight);
    }
  std::sort(occupied.begin(), occupied.end(), [&](std::uint32_t a, std::uint32_t b) {
    return density_[a] != density_[b] ? density_[a] < density_[b] : a < b;
  });
  double below = 0;
  for (const std::uint32_t b : occupied) {
    below += count[b];
    if (below > kRare * total) break;
    rarest_ = density_[b];
  }
}

std::optional<MaskRepair> MaskRepair::learn(std::span<CoarseView> views, std::span<const Image> photos,
                                            std::span<const std::uint8_t> fixed, Job& job) {
  if (views.size() < kLeastViews) return std::nullopt;
  std::optional<MaskRepair> repair;
  for (int round = 1;; ++round) {
    std::optional<CoarseHull> hull = carve_forgiving(views, job);
    if (!hull) return std::nullopt;
    repair = MaskRepair(std::move(*hull));
    if (round == kMostRounds) return repair;
    std::vector<std::size_t> mended(views.size(), 0), object(views.size(), 0);
    parallel_for(job, views.size(), [&](std::size_t i) {
      Image& mask = views[i].mask;
      const bool judged = !fixed[i] && repair->contradict(views[i]);
      const auto patch = judged ? repair->find(views[i], photos[i]) : std::nullopt;
      for (int y = 0; y < mask.height(); ++y) {
        std::uint8_t* row = mask.row<std::uint8_t>(y);
        for (int x = 0; x < mask.width(); ++x) {
          object[i] += row[x] >= 128;
          if (patch && patch->pixels.row<std::uint8_t>(y)[x]) row[x] = 255, ++mended[i];
        }
      }
    });
    std::size_t all_mended = 0, all_object = 0;
    for (std::size_t i = 0; i < views.size(); ++i) all_mended += mended[i], all_object += object[i];
    if (double(all_mended) <= kSettled * double(all_object)) return repair;
  }
}

bool MaskRepair::contradict(const CoarseView& view) const {
  const Image& mask = view.mask;
  const Image core = hull_.depth(view, kSure);
  std::size_t sure = 0;
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t *in = mask.row<std::uint8_t>(y), *deep = core.row<std::uint8_t>(y);
    for (int x = 0; x < mask.width(); ++x) sure += in[x] < 128 && deep[x];
  }
  return sure >= least_sure(mask);
}

std::optional<MaskRepair::Patch> MaskRepair::find(const CoarseView& view, const Image& photo) const {
  const Image& mask = view.mask;
  const int width = mask.width(), height = mask.height();
  const Image depth = hull_.depth(view, 1);
  Image outside(width, height, 1);
  int x0 = width, x1 = 0, y0 = height, y1 = 0;  // box of the doubtful pixels
  for (int y = 0; y < height; ++y) {
    const std::uint8_t *in = mask.row<std::uint8_t>(y), *d = depth.row<std::uint8_t>(y);
    std::uint8_t* inside = outside.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x) {
      inside[x] = d[x] ? 255 : 0;
      if (d[x] && in[x] < 128) {
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
        y0 = std::min(y0, y), y1 = y + 1;
      }
    }
  }
  outside = grown(outside, hull_.margin_px(view) / 2 + 1);
  for (int y = 0; y < height; ++y) {
    const bool in_rows = y >= view.frame.y0 && y < view.frame.y1;
    std::uint8_t* row = outside.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x) row[x] = in_rows && x >= view.frame.x0 && x < view.frame.x1 && !row[x] ? 255 : 0;
  }
  Patch patch{Image(width, height, 1), Image(width, height, 1), RareColors(photo, outside)};

  // Doubtful pixels in whose window at least half of the doubtful ones have rare colours.
  const int w = x1 - x0, h = y1 - y0;
  WindowSum doubtful(w, h), rare(w, h);
  for (int y = 0; y < h; ++y) {
    const std::uint8_t *in = mask.row<std::uint8_t>(y0 + y) + x0, *d = depth.row<std::uint8_t>(y0 + y) + x0;
    const std::uint8_t* p = photo.row<std::uint8_t>(y0 + y) + 3 * x0;
    std::uint32_t row_doubtful = 0, row_rare = 0;
    for (int x = 0; x < w; ++x, p += 3) {
      const bool is = d[x] && in[x] < 128;
      row_doubtful += is;
      row_rare += is && patch.colors.rare(p);
      doubtful.at(x + 1, y + 1) = doubtful.at(x + 1, y) + row_doubtful;
      rare.at(x + 1, y + 1) = rare.at(x + 1, y) + row_rare;
    }
  }
  for (int y = 0; y < h; ++y) {
    const std::uint8_t *in = mask.row<std::uint8_t>(y0 + y) + x0, *d = depth.row<std::uint8_t>(y0 + y) + x0;
    std::uint8_t* to = patch.reach.row<std::uint8_t>(y0 + y) + x0;
    const int v0 = std::max(0, y - kWindow), v1 = std::min(h, y + kWindow + 1);
    for (int x = 0; x < w; ++x) {
      if (!d[x] || in[x] >= 128) continue;
      const int u0 = std::max(0, x - kWindow), u1 = std::min(w, x + kWindow + 1);
      const auto sum = [&](WindowSum& s) { return s.at(u1, v1) - s.at(u0, v1) - s.at(u1, v0) + s.at(u0, v0); };
      to[x] = 2 * sum(rare) >= sum(doubtful) ? 255 : 0;
    }
  }
  // Their connected parts that come deep enough.
  bool any = false;
  Image visited = patch.reach;  // 255: not yet
  std::vector<std::array<int, 2>> part;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      if (!visited.row<std::uint8_t>(y)[x] || depth.row<std::uint8_t>(y)[x] < kSure) continue;
      part.assign(1, {x, y});
      visited.row<std::uint8_t>(y)[x] = 0;
      std::size_t sure = 0;
      for (std::size_t i = 0; i < part.size(); ++i) {
        const auto [px, py] = part[i];
        sure += depth.row<std::uint8_t>(py)[px] >= kSure;
        for (int v = std::max(y0, py - 1); v < std::min(y1, py + 2); ++v)
          for (int u = std::max(x0, px - 1); u < std::min(x1, px + 2); ++u) {
            std::uint8_t& open = visited.row<std::uint8_t>(v)[u];
            if (open) open = 0, part.push_back({u, v});
          }
      }
      if (sure < least_sure(mask)) continue;
      any = true;
      for (const auto& [px, py] : part) patch.pixels.row<std::uint8_t>(py)[px] = 255;
    }
  if (!any) return std::nullopt;
  // Beside the patch: coarse pixels that the mask has as object may hold background, thinned away.
  Image reach = grown(patch.pixels, 1);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = reach.row<std::uint8_t>(y);
    const std::uint8_t* d = depth.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x)
      if (!d[x]) row[x] = 0;
  }
  patch.reach = std::move(reach);
  return patch;
}

void mend(Image& mask, const Image& photo, const MaskRepair::Patch& patch, int step) {
  for (int y = 0; y < mask.height(); ++y) {
    const int v = std::min(y / step, patch.pixels.height() - 1);
    const std::uint8_t *is = patch.pixels.row<std::uint8_t>(v), *may_be = patch.reach.row<std::uint8_t>(v);
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    const std::uint8_t* p = photo.row<std::uint8_t>(y);
    for (int u = 0; u < patch.pixels.width(); ++u) {
      if (!may_be[u]) continue;
      for (int x = u * step; x < std::min((u + 1) * step, mask.width()); ++x)
        if (is[u] || patch.colors.rare(p + 3 * x)) row[x] = 255;
    }
  }
}

}  // namespace lumihull::hull
