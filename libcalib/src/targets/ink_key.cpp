#include <lumihull/base/error.h>
#include <lumihull/calib/ink_key.h>
#include <lumihull/calib/key_image.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr std::uint64_t kLeastInk = 1000;
constexpr std::size_t kInkSamples = 20'000, kAroundSamples = 100'000;
/// Parts of a circle's radius: ink within the one, paper between the others. A ring of neighbours begins at 3 radii.
constexpr double kInk = 0.7, kPaperFrom = 1.35, kPaperTo = 1.65;

/// What a pixel is taken for. A later mark does not take away a `busy` one.
enum Mark : std::uint8_t { kOpen = 0, kBusy = 1, kInkMark = 2, kPaperMark = 3 };

/// Pixels with centre within `reach` radii of the ellipse: body(x, y, distance in radii).
template <class Body>
void for_pixels(const Vector2d& center, const Matrix2d& shape, double reach, int width, int height, Body body) {
  const Matrix2d inverse = shape.inverse();
  const double dx = reach * std::sqrt(shape(0, 0)), dy = reach * std::sqrt(shape(1, 1));
  const int x0 = int(std::clamp(std::floor(center.x() - dx), 0.0, double(width)));
  const int x1 = int(std::clamp(std::ceil(center.x() + dx), 0.0, double(width)));
  const int y0 = int(std::clamp(std::floor(center.y() - dy), 0.0, double(height)));
  const int y1 = int(std::clamp(std::ceil(center.y() + dy), 0.0, double(height)));
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const Vector2d u = Vector2d(x + .5, y + .5) - center;
      const double r2 = u.dot(inverse * u);
      if (r2 <= reach * reach) body(x, y, std::sqrt(r2));
    }
}

}  // namespace

void InkSamples::add(const Image& photo, const TargetSet& set, const Detections& found) {
  const Image bytes = keyable(photo);
  const int width = bytes.width(), height = bytes.height();
  Image marks(width, height, 1);
  const auto mark = [&](int x, int y) -> std::uint8_t& { return marks.row<std::uint8_t>(y)[x]; };

  for (const RefusedTarget& r : found.refused)
    if (std::isfinite(r.size_px) && r.size_px > 0 && r.pixel.allFinite())
      for_pixels(r.pixel, Matrix2d::Identity() * (r.size_px * r.size_px), 1, width, height,
                 [&](int x, int y, double) { mark(x, y) = kBusy; });
  bool any = false;
  for (const Detection& d : found.targets) {
    if (d.design < 0 || d.design >= int(set.designs.size())) continue;
    const TargetDesign& design = set.designs[std::size_t(d.design)];
    if (design.family.kind() != TargetKind::circles) {
      for (const Feature& f : d.features) {
        const double side = (d.features.front().pixel - f.pixel).norm();
        for_pixels(f.pixel, Matrix2d::Identity() * (side * side + 1), 1.5, width, height,
                   [&](int x, int y, double) { mark(x, y) = kBusy; });
      }
      continue;
    }
    any = true;
    const std::vector<Cell> cells = design.family.cells(d.id);
    const double pitch = design.size_m / design.circle_radius_m();  // radii
    struct Disc {
      Vector2d center;
      Matrix2d shape;
      bool ink;
    };
    std::vector<Disc> discs;
    for (const Feature& f : d.features) {
      const Vector2d c = f.dual_conic.topRightCorner<2, 1>();
      const Matrix2d shape = c * c.transpose() - f.dual_conic.topLeftCorner<2, 2>();
      if (!shape.allFinite() || !(shape.determinant() > 0) || !(shape(0, 0) > 0)) continue;
      discs.push_back({c, shape, cells[std::size_t(f.index)] == Cell::dark});
    }
    for (const Disc& disc : discs)
      for_pixels(disc.center, disc.shape, 1.5 * pitch, width, height, [&](int x, int y, double) {
        if (mark(x, y) == kOpen) mark(x, y) = kBusy;
      });
    for (const Disc& disc : discs)
      for_pixels(disc.center, disc.shape, kPaperTo, width, height, [&](int x, int y, double r) {
        if (disc.ink && r <= kInk) mark(x, y) = kInkMark;
        if (r >= kPaperFrom && pitch > kPaperTo + kPaperFrom) mark(x, y) = kPaperMark;
      });
  }
  if (!any) return;
  for (int y = 0; y < height; ++y) {
    const auto* rgb = bytes.row<std::uint8_t>(y);
    const auto* m = marks.row<std::uint8_t>(y);
    for (int x = 0; x < width; ++x, rgb += 3) {
      if (m[x] == kBusy) continue;
      (m[x] == kInkMark ? ink_ : around_).add({rgb[0], rgb[1], rgb[2]});
    }
  }
}

ColorKey InkSamples::train(int k, Job& job) const {
  if (ink_.total() < kLeastInk)
    throw Error(ErrorCode::degenerate, "only " + std::to_string(ink_.total()) +
                                           " pixels of ink were found, 1000 are needed: take photographs in "
                                           "which targets are larger, or leave the key out");
  // Ink that was not taken for such (the bar on a sheet, a target that was overlooked) must not outvote what was: where
  // a cell of 8 x 8 x 8 colours holds a larger part of the ink than of the rest, it is the ink's.
  const auto cell = [](Rgb c) {
    return std::size_t(c[0] >> 3) << 10 | std::size_t(c[1] >> 3) << 5 | std::size_t(c[2] >> 3);
  };
  const double all_ink = double(ink_.total()), all_around = double(around_.total());
  const std::vector<ColorCount> ink = ink_.counts();
  std::vector<ColorCount> around = around_.counts();
  std::vector<double> balance(std::size_t(1) << 15);
  for (const ColorCount& c : ink) balance[cell(c.color)] += double(c.count) / all_ink;
  for (const ColorCount& c : around) balance[cell(c.color)] -= double(c.count) / all_around;
  std::erase_if(around, [&](const ColorCount& c) { return balance[cell(c.color)] > 0; });
  return ColorKey::train(subsample(around, kAroundSamples), subsample(ink, kInkSamples), k, job);
}

}  // namespace lumihull::calib
