#include "wall_key.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lumihull::hull {
namespace {

constexpr double kStep = 0.1;          // half sides between looks at a sheet's margin
constexpr double kLeastHalfSide = 12;  // coarse pixels; of smaller sheets the margin is not seen
constexpr double kPaperShare = 0.25;   // of looks that must show paper's colours; others see what stands before it
constexpr double kLeastLooks = 6;
constexpr int kShift = 1, kBins = 256 >> kShift;

/// How often colours occur, in bins of 2 levels, spread with weights 1 2 1 along each axis.
class FineColors {
 public:
  FineColors() : counts_(std::size_t(kBins) * kBins * kBins, 0) {}
  void add(const std::uint8_t* rgb) {
    ++counts_[(std::size_t(rgb[0] >> kShift) * kBins + (rgb[1] >> kShift)) * kBins + (rgb[2] >> kShift)];
  }
  void add(const FineColors& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  }
  double around(const calib::Rgb& c) const {
    const int r = c[0] >> kShift, g = c[1] >> kShift, b = c[2] >> kShift;
    double sum = 0;
    for (int i = std::max(r - 1, 0); i <= std::min(r + 1, kBins - 1); ++i)
      for (int j = std::max(g - 1, 0); j <= std::min(g + 1, kBins - 1); ++j)
        for (int k = std::max(b - 1, 0); k <= std::min(b + 1, kBins - 1); ++k)
          sum += counts_[(std::size_t(i) * kBins + std::size_t(j)) * kBins + std::size_t(k)] * (i == r ? 1 : 0.5) *
                 (j == g ? 1 : 0.5) * (k == b ? 1 : 0.5);
    return sum;
  }

 private:
  std::vector<std::uint32_t> counts_;
};

}  // namespace

void measure_paper(std::span<Sheet> sheets, std::span<const CoarseView> views, std::span<const Image> photos,
                   const CoarseHull& hull, const PaperColors& paper, Job& job) {
  constexpr int kLooks = int((Sheet::kFarthest - 1) / kStep);
  struct Looks {
    std::array<std::array<int, kLooks>, 4> all{}, paper{};
  };
  std::vector<Image> near(views.size());
  parallel_for(job, views.size(),
               [&](std::size_t i) { near[i] = hull.silhouette(views[i], 2 * hull.margin_px(views[i])); });
  parallel_for(job, sheets.size(), [&](std::size_t k) {
    Sheet& s = sheets[k];
    Looks looks;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const CoarseView& v = views[i];
      if (s.normal.dot(v.view.center() - s.center) <= 0) continue;
      Matrix23d jacobian;
      const auto middle = v.view.camera.project(v.view.cam_from_world * s.center, &jacobian);
      if (!middle || !v.view.camera.contains(*middle)) continue;
      const Eigen::Matrix3d turn = v.view.cam_from_world.rotation.toRotationMatrix();
      if (std::min((jacobian * (turn * s.along)).norm(), (jacobian * (turn * s.across)).norm()) / v.step <
          kLeastHalfSide)
        continue;
      for (std::size_t side = 0; side < 4; ++side) {
        const Eigen::Vector3d out = (side % 2 ? s.across : s.along) * (side < 2 ? 1 : -1);
        const Eigen::Vector3d& beside = side % 2 ? s.along : s.across;
        for (int look = 0; look < kLooks; ++look)
          for (int at = -1; at <= 1; ++at) {
            const auto px = v.view.project(s.center + (1 + (look + 0.5) * kStep) * out + 0.6 * at * beside);
            if (!px) continue;
            const int x = int(std::floor(px->x() / v.step)), y = int(std::floor(px->y() / v.step));
            if (x < v.frame.x0 || x >= v.frame.x1 || y < v.frame.y0 || y >= v.frame.y1) continue;
            if (near[i].row<std::uint8_t>(y)[x]) continue;
            ++looks.all[side][std::size_t(look)];
            looks.paper[side][std::size_t(look)] += paper.is_paper(photos[i].row<std::uint8_t>(y) + 3 * x);
          }
      }
    }
    for (std::size_t side = 0; side < 4; ++side)
      for (int look = 0; look < kLooks; ++look) {
        const double all = looks.all[side][std::size_t(look)];
        if (all < kLeastLooks || looks.paper[side][std::size_t(look)] >= kPaperShare * all) continue;
        s.reach[side] = 1 + (look + 1) * kStep;
        break;
      }
  });
}

std::optional<calib::ColorKey> key_beside_sheets(const calib::ColorKey& key, std::span<const Sheet> sheets,
                                                 std::span<const CoarseView> views, std::span<const Image> photos,
                                                 const CoarseHull& hull, Job& job) {
  FineColors on, beside;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const CoarseView& v = views[i];
    const Image near = hull.silhouette(v, 2 * hull.margin_px(v)), parts = sheets_in(v, sheets);
    for (int y = v.frame.y0; y < v.frame.y1; ++y) {
      const std::uint8_t *is_near = near.row<std::uint8_t>(y), *part = parts.row<std::uint8_t>(y);
      const std::uint8_t* p = photos[i].row<std::uint8_t>(y) + 3 * v.frame.x0;
      for (int x = v.frame.x0; x < v.frame.x1; ++x, p += 3)
        if (!is_near[x]) (part[x] == kNoSheet ? beside : on).add(p);
    }
  }
  std::vector<calib::ColorCount> kept;
  double owed = 0;
  for (calib::ColorCount c : key.background()) {
    const double s = on.around(c.color), r = beside.around(c.color);
    owed += s + r > 0 ? c.count * r / (s + r) : c.count;
    c.count = std::uint32_t(owed);
    owed -= c.count;
    if (c.count > 0) kept.push_back(c);
  }
  if (kept.empty()) return std::nullopt;
  return calib::ColorKey::train(kept, key.foreground(), key.k(), job);
}

void key_places(Image& mask, const Image& photo, const Image& sheet_parts, const calib::ColorKey& beside_sheets,
                bool edges) {
  const int width = mask.width(), pixels = std::max(1, width / sheet_parts.width());
  Image object(width, mask.height(), 1);
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t *row = mask.row<std::uint8_t>(y), *p = photo.row<std::uint8_t>(y);
    const std::uint8_t* part = sheet_parts.row<std::uint8_t>(std::min(y / pixels, sheet_parts.height() - 1));
    std::uint8_t* to = object.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x, p += 3)
      if (row[x] < 128 && part[std::min(x / pixels, sheet_parts.width() - 1)] == kNoSheet)
        to[x] = beside_sheets.is_object({p[0], p[1], p[2]}) ? 255 : 0;
  }
  // Not along edges, where object and wall run into each other.
  const Image core = edges ? std::move(object) : grown(shrunk(object, 1), 1);
  for (int y = 0; y < mask.height(); ++y) {
    std::uint8_t* row = mask.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x)
      if (core.row<std::uint8_t>(y)[x]) row[x] = 255;
  }
}

}  // namespace lumihull::hull
