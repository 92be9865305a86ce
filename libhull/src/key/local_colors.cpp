#include "local_colors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::hull {
namespace {

constexpr int kTile = 16;                         // coarse pixels a side, judged by the samples of three by three tiles
constexpr int kShift = 2, kBins = 256 >> kShift;  // of colours, a channel
constexpr float kAnywhere = 0.05f;                // weight of the whole photograph's colours beside those nearby
constexpr float kUnknown = 3e-5f;                 // share that a colour has which was not seen
/// The same for the object where a pixel is not deep in the hull: mixtures of paper, ink and wall are seen nowhere
/// else.
constexpr float kUnknownAtRim = 0.3f * kUnknown;
/// Any object may shine: a share that clipped white has on it at least.
constexpr float kShine = 0.02f;
constexpr int kClipped = 245;
/// How much likelier object than background, by what the hull says: beside it, keyed as object; beside it, keyed as
/// background; one, two, and more voxels deep.
constexpr float kBeside = 0.5f, kAround = 1;
constexpr std::array<float, 3> kDeep{2, 8, 32};
constexpr float kShadowOdds = 0.03f;  // what is surely shadow
constexpr float kPaperOdds = 4;       // and by a colour that only sheets have
constexpr double kLeastSure = 5e-5;   // of the picture: so many pixels so deep make a mask doubtful
constexpr int kRounds = 6;
constexpr float kAgree = 3;      // log odds that a neighbour of the same colour is worth
constexpr float kSigma = 12;     // levels by which neighbours' colours may differ
constexpr int kFarthest = 2048;  // squared difference of colours beyond which neighbours do not count

/// kPaperLike: object in a colour of the sheets' paper.
enum Kind : std::uint8_t { kNeither, kObject, kPaperLike, kWall, kOnSheet };

/// How often colours occur among samples, each counted in its bin and, less, in those around it.
class ColorCounts {
 public:
  ColorCounts() : samples_(std::size_t(kBins) * kBins * kBins, 0), counts_(samples_.size(), 0) {}
  static std::uint32_t bin(const std::uint8_t* rgb) {
    return std::uint32_t((rgb[0] >> kShift) * kBins + (rgb[1] >> kShift)) * kBins + std::uint32_t(rgb[2] >> kShift);
  }
  void add(std::uint32_t at) {
    if (samples_[at]++ == 0) touched_.push_back(at);
  }
  /// After all were added. Many samples share few bins: each bin is spread once.
  void smooth() {
    for (const std::uint32_t at : touched_) {
      const float weight = float(samples_[at]);
      total_ += weight;
      spread(at, [&](float& count, float part) { count += weight * part; });
    }
  }
  void clear() {
    for (const std::uint32_t at : touched_) {
      samples_[at] = 0;
      spread(at, [](float& count, float) { count = 0; });
    }
    touched_.clear();
    total_ = 0;
  }
  float share(std::uint32_t at) const { return total_ > 0 ? counts_[at] / total_ : 0; }
  /// Of both together.
  float share(std::uint32_t at, const ColorCounts& other) const {
    const float total = total_ + other.total_;
    return total > 0 ? (counts_[at] + other.counts_[at]) / total : 0;
  }

 private:
  /// Binomial weights 1 2 1 along each axis, 1 in the middle.
  template <class Visit>
  void spread(std::uint32_t at, Visit&& visit) {
    const int r = int(at) / (kBins * kBins), g = int(at) / kBins % kBins, b = int(at) % kBins;
    for (int i = std::max(r - 1, 0); i <= std::min(r + 1, kBins - 1); ++i)
      for (int j = std::max(g - 1, 0); j <= std::min(g + 1, kBins - 1); ++j)
        for (int k = std::max(b - 1, 0); k <= std::min(b + 1, kBins - 1); ++k)
          visit(counts_[std::size_t((i * kBins + j) * kBins + k)],
                (i == r ? 1 : 0.5f) * (j == g ? 1 : 0.5f) * (k == b ? 1 : 0.5f));
  }
  std::vector<std::uint32_t> samples_;
  std::vector<float> counts_;
  std::vector<std::uint32_t> touched_;  ///< bins that have samples
  float total_ = 0;
};

/// What each coarse pixel is a sample of, and of which colour.
struct Samples {
  std::vector<Kind> kinds;
  std::vector<std::uint32_t> bins;
};

Samples sample(const Image& mask, const Image& photo, const CoarseView& view, const Image& depth, const Image& near,
               const Clues& clues) {
  const int width = depth.width(), height = depth.height(), pixels = mask.width() / width;
  const auto object = [&](int x, int y) {
    return mask.row<std::uint8_t>(y * pixels + pixels / 2)[x * pixels + pixels / 2] >= 128;
  };
  Samples out{std::vector<Kind>(std::size_t(width) * std::size_t(height), kNeither),
              std::vector<std::uint32_t>(std::size_t(width) * std::size_t(height), 0)};
  for (int y = std::max(1, view.frame.y0); y < std::min(height - 1, view.frame.y1); ++y)
    for (int x = std::max(1, view.frame.x0); x < std::min(width - 1, view.frame.x1); ++x) {
      const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
      const std::uint8_t* p = photo.row<std::uint8_t>(y * pixels + pixels / 2) + 3 * (x * pixels + pixels / 2);
      out.bins[i] = ColorCounts::bin(p);
      if (!near.row<std::uint8_t>(y)[x])
        out.kinds[i] = clues.sheet_parts && clues.sheet_parts->row<std::uint8_t>(y)[x] != kNoSheet ? kOnSheet : kWall;
      else if (depth.row<std::uint8_t>(y)[x] && object(x, y) && object(x - 1, y) && object(x + 1, y) &&
               object(x, y - 1) && object(x, y + 1))
        out.kinds[i] = clues.paper && clues.paper->is_paper(p) ? kPaperLike : kObject;
    }
  return out;
}

struct Open {
  int x, y;
  float odds;  ///< log, of object against background
};

/// Neighbours of like colour come to agree. belief: -1 … 1.
void agree(Image& mask, const Image& photo, std::span<const Open> open) {
  if (open.empty()) return;
  // By squared difference; the last is of neighbours that do not count.
  static const std::vector<float> alike = [] {
    std::vector<float> table(kFarthest + 1, 0);
    for (int d = 0; d < kFarthest; ++d) table[std::size_t(d)] = kAgree * std::exp(-float(d) / (2 * kSigma * kSigma));
    return table;
  }();
  int x0 = mask.width(), x1 = 0, y0 = mask.height(), y1 = 0;
  for (const Open& o : open) {
    x0 = std::min(x0, o.x - 1), x1 = std::max(x1, o.x + 2);
    y0 = std::min(y0, o.y - 1), y1 = std::max(y1, o.y + 2);
  }
  // All neighbours of what is open, those beyond the picture's border, too: they do not count.
  const std::size_t width = std::size_t(x1 - x0);
  std::vector<float> belief(width * std::size_t(y1 - y0), 0), next(open.size());
  const auto at = [&](int x, int y) { return std::size_t(y - y0) * width + std::size_t(x - x0); };
  for (int y = std::max(y0, 0); y < std::min(y1, mask.height()); ++y)
    for (int x = std::max(x0, 0); x < std::min(x1, mask.width()); ++x)
      belief[at(x, y)] = mask.row<std::uint8_t>(y)[x] >= 128 ? 1.f : -1.f;
  std::vector<std::array<std::uint16_t, 9>> apart(open.size());
  for (std::size_t i = 0; i < open.size(); ++i) {
    const Open& o = open[i];
    belief[at(o.x, o.y)] = std::tanh(o.odds / 2);
    apart[i].fill(kFarthest);
    const std::uint8_t* c = photo.row<std::uint8_t>(o.y) + 3 * o.x;
    for (int v = std::max(0, o.y - 1); v < std::min(mask.height(), o.y + 2); ++v)
      for (int u = std::max(0, o.x - 1); u < std::min(mask.width(), o.x + 2); ++u) {
        if (u == o.x && v == o.y) continue;
        const std::uint8_t* q = photo.row<std::uint8_t>(v) + 3 * u;
        const int r = c[0] - q[0], g = c[1] - q[1], b = c[2] - q[2];
        apart[i][std::size_t(3 * (v - o.y + 1) + u - o.x + 1)] =
            std::uint16_t(std::min(r * r + g * g + b * b, kFarthest));
      }
  }
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < open.size(); ++i) {
      const float* corner = &belief[at(open[i].x - 1, open[i].y - 1)];
      next[i] = open[i].odds;
      for (std::size_t k = 0; k < 9; ++k) next[i] += alike[apart[i][k]] * corner[k / 3 * width + k % 3];
    }
    for (std::size_t i = 0; i < open.size(); ++i) belief[at(open[i].x, open[i].y)] = std::tanh(next[i] / 2);
  }
  for (const Open& o : open) mask.row<std::uint8_t>(o.y)[o.x] = belief[at(o.x, o.y)] > 0 ? 255 : 0;
}

}  // namespace

std::size_t decide_by_surroundings(Image& mask, const Image& photo, const CoarseView& view, const CoarseHull& hull,
                                   const CoarseHull& wide, const Clues& clues, int least) {
  const Image depth = hull.depth(view, 1), around = wide.depth(view, 1);
  const int width = depth.width(), height = depth.height(), pixels = mask.width() / width;
  if (least > 0) {
    std::size_t sure = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        sure += depth.row<std::uint8_t>(y)[x] >= least &&
                mask.row<std::uint8_t>(y * pixels + pixels / 2)[x * pixels + pixels / 2] < 128;
    if (double(sure) < std::max(4.0, kLeastSure * width * height)) return 0;
  }
  const Samples samples = sample(mask, photo, view, depth, wide.silhouette(view, hull.margin_px(view)), clues);
  ColorCounts all_object, all_paper_like, all_wall, all_sheet, object, paper_like, wall, sheet;
  for (std::size_t i = 0; i < samples.kinds.size(); ++i) {
    if (samples.kinds[i] == kObject) all_object.add(samples.bins[i]);
    if (samples.kinds[i] == kPaperLike) all_paper_like.add(samples.bins[i]);
    if (samples.kinds[i] == kWall) all_wall.add(samples.bins[i]);
    if (samples.kinds[i] == kOnSheet) all_sheet.add(samples.bins[i]);
  }
  all_object.smooth(), all_paper_like.smooth(), all_wall.smooth(), all_sheet.smooth();
  std::vector<Open> open;
  std::size_t were_object = 0;
  for (int y0 = 0; y0 < height; y0 += kTile)
    for (int x0 = 0; x0 < width; x0 += kTile) {
      const int y1 = std::min(height, y0 + kTile), x1 = std::min(width, x0 + kTile);
      bool learned = false;  // the tile's colours: most tiles have no pixel that asks
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
          const int deep = depth.row<std::uint8_t>(y)[x];
          const bool may_be = deep || around.row<std::uint8_t>(y)[x];
          const bool no_sheet = clues.sheet_parts && clues.sheet_parts->row<std::uint8_t>(y)[x] == kNoSheet;
          for (int v = y * pixels; v < (y + 1) * pixels; ++v) {
            const std::uint8_t* row = mask.row<std::uint8_t>(v);
            const std::uint8_t* p = photo.row<std::uint8_t>(v) + 3 * x * pixels;
            for (int u = x * pixels; u < (x + 1) * pixels; ++u, p += 3) {
              const bool is = row[u] >= 128;
              if (is ? deep > 0 || least > 0 : !may_be || (least > 0 && deep == 0)) continue;
              if (!learned) {
                learned = true;
                object.clear(), paper_like.clear(), wall.clear(), sheet.clear();
                for (int t = std::max(0, y0 - kTile); t < std::min(height, y1 + kTile); ++t)
                  for (int s = std::max(0, x0 - kTile); s < std::min(width, x1 + kTile); ++s) {
                    const std::size_t i = std::size_t(t) * std::size_t(width) + std::size_t(s);
                    if (samples.kinds[i] == kObject) object.add(samples.bins[i]);
                    if (samples.kinds[i] == kPaperLike) paper_like.add(samples.bins[i]);
                    if (samples.kinds[i] == kWall) wall.add(samples.bins[i]);
                    if (samples.kinds[i] == kOnSheet) sheet.add(samples.bins[i]);
                  }
                object.smooth(), paper_like.smooth(), wall.smooth(), sheet.smooth();
              }
              const std::uint32_t color = ColorCounts::bin(p);
              // On sheets a paper-coloured object can't be told from paper: what is like paper proves nothing there.
              const float of_object =
                  no_sheet ? object.share(color, paper_like) + kAnywhere * all_object.share(color, all_paper_like)
                           : object.share(color) + kAnywhere * all_object.share(color);
              float odds = of_object + (deep > 1 ? kUnknown : kUnknownAtRim);
              if (std::min({p[0], p[1], p[2]}) >= kClipped) odds += kShine;
              odds /= kUnknown + (no_sheet ? wall.share(color) + kAnywhere * all_wall.share(color)
                                           : wall.share(color, sheet) + kAnywhere * all_wall.share(color, all_sheet));
              odds *= deep ? kDeep[std::size_t(std::min(deep, 3) - 1)] : is ? kBeside : kAround;
              if (clues.paper && clues.paper->is_paper(p)) odds *= kPaperOdds;
              if (clues.shadows && clues.shadows->is_sure(p)) odds *= kShadowOdds;
              open.push_back({u, v, std::log(odds)});
              were_object += is;
            }
          }
        }
    }
  agree(mask, photo, open);
  std::size_t now_object = 0;
  for (const Open& o : open) now_object += mask.row<std::uint8_t>(o.y)[o.x] >= 128;
  return now_object > were_object ? now_object - were_object : 0;
}

}  // namespace lumihull::hull
