#include "paper_colors.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace lumihull::hull {
namespace {

constexpr double kPrint = 0.98;  // of a target's half side: what is printed for certain
constexpr double kMargin = 2.2;  // half sides from a target's middle within which there may be paper
constexpr std::uint8_t kMaybe = 1, kSheet = 2;
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

/// A target's plane, as far as its points reach.
struct Sheet {
  Eigen::Vector3d center, normal, along, across;  ///< `along` and `across` lead to the middles of its sides
};

/// Sets the pixels of a convex polygon to at least `value`.
void fill(Image& image, std::span<const Eigen::Vector2d> polygon, std::uint8_t value) {
  double top = INFINITY, bottom = -INFINITY;
  for (const auto& p : polygon) top = std::min(top, p.y()), bottom = std::max(bottom, p.y());
  const int y1 = int(std::min(double(image.height()), std::ceil(bottom)));
  for (int y = int(std::max(0.0, std::floor(top))); y < y1; ++y) {
    double left = INFINITY, right = -INFINITY;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Eigen::Vector2d &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      if ((a.y() < y + 0.5) == (b.y() < y + 0.5)) continue;
      const double x = a.x() + (y + 0.5 - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, x), right = std::max(right, x);
    }
    std::uint8_t* row = image.row<std::uint8_t>(y);
    for (int x = int(std::max(0.0, std::floor(left))); x < std::min(double(image.width()), right); ++x)
      row[x] = std::max(row[x], value);
  }
}

/// Where a view shows what is printed for certain, and where there may be paper; 0 elsewhere.
Image sheets_of(const CoarseView& v, std::span<const Sheet> sheets) {
  Image out(v.mask.width(), v.mask.height(), 1);
  for (const Sheet& s : sheets) {
    if (s.normal.dot(v.view.center() - s.center) <= 0) continue;
    for (const auto& [reach, value] : {std::pair(kMargin, kMaybe), std::pair(kPrint, kSheet)}) {
      std::vector<Eigen::Vector2d> outline;
      constexpr int kSteps = 4;  // along a side: lenses bend it
      for (int k = 0; k < 4 * kSteps; ++k) {
        const double t = 2.0 * (k % kSteps) / kSteps - 1;
        const double x = k / kSteps == 0 ? t : k / kSteps == 1 ? 1 : k / kSteps == 2 ? -t : -1;
        const double y = k / kSteps == 0 ? -1 : k / kSteps == 1 ? t : k / kSteps == 2 ? 1 : -t;
        const auto px = v.view.project(s.center + reach * (x * s.along + y * s.across));
        if (px) outline.push_back(*px / v.step);
      }
      if (outline.size() == 4 * kSteps) fill(out, outline, value);
    }
  }
  return out;
}

std::vector<Sheet> sheets_of(std::span<const calib::CalibratedBody> bodies, const Eigen::Vector3d& eyes) {
  std::vector<Sheet> sheets;
  for (const calib::CalibratedBody& body : bodies) {
    if (!body.placed) continue;
    std::map<std::pair<int, int>, std::vector<std::size_t>> targets;
    for (std::size_t k = 0; k < std::min(body.features.size(), body.points.size()); ++k)
      targets[{body.features[k].design, body.features[k].id}].push_back(k);
    for (const auto& [name, points] : targets) {
      if (points.size() < 4) continue;
      // Sides lie as printed: along the target's own axes.
      Sheet s;
      const Eigen::Quaterniond& turn = body.body.world_from_body.rotation;
      s.center = Eigen::Vector3d::Zero();
      for (const std::size_t k : points) s.center += body.points[k] / double(points.size());
      const Eigen::Vector3d x = turn * Eigen::Vector3d::UnitX(), y = turn * Eigen::Vector3d::UnitY();
      double wide = 0, high = 0;
      for (const std::size_t k : points) {
        wide = std::max(wide, std::abs(x.dot(body.points[k] - s.center)));
        high = std::max(high, std::abs(y.dot(body.points[k] - s.center)));
      }
      s.along = wide * x, s.across = high * y;
      s.normal = x.cross(y);
      if (s.normal.dot(eyes - s.center) < 0) s.normal = -s.normal;
      sheets.push_back(s);
    }
  }
  return sheets;
}

}  // namespace

std::optional<PaperColors> PaperColors::learn(std::span<const calib::CalibratedBody> bodies,
                                              std::span<const CoarseView> views, std::span<const Image> photos,
                                              const CoarseHull& hull, Job& job) {
  Eigen::Vector3d eyes = Eigen::Vector3d::Zero();
  for (const CoarseView& v : views) eyes += v.view.center() / double(views.size());
  const std::vector<Sheet> sheets = sheets_of(bodies, eyes);
  std::vector<Palette> on(views.size()), beside(views.size());
  parallel_for(job, views.size(), [&](std::size_t i) {
    const CoarseView& v = views[i];
    const Image near = hull.silhouette(v, hull.margin_px(v)), kinds = sheets_of(v, sheets);
    for (int y = v.frame.y0; y < v.frame.y1; ++y) {
      const std::uint8_t *is_near = near.row<std::uint8_t>(y), *kind = kinds.row<std::uint8_t>(y);
      const std::uint8_t* p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
      for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3)
        if (!is_near[x] && kind[x] != kMaybe) (kind[x] ? on : beside)[i].add(p);
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
