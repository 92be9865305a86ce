// What a calibration made of one photograph, drawn into it.
#include <lumihull/base/error.h>
#include <lumihull/calib/lens_calibration.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "../targets/canvas.h"

namespace lumihull::calib {
namespace {

constexpr Rgb kCounts{60, 230, 60}, kOutlier{255, 130, 0}, kResidual{255, 0, 255}, kWhite{255, 255, 255};

}  // namespace

Image draw_residuals(const Image& photo, const LensCalibration& calibration, std::span<const BoardView> views,
                     std::span<const int> shown, double magnify) {
  if (photo.empty()) throw Error(ErrorCode::invalid_argument, "the picture is empty", "draw residuals");
  if (!std::isfinite(magnify)) throw Error(ErrorCode::invalid_argument, "must be finite", "magnify");
  Image rgb = converted(photo, PixelType::u8, 3);
  Canvas canvas(rgb);
  const double unit = std::max(1.0, std::max(rgb.width(), rgb.height()) / 1600.0), arm = 4 * unit;
  int points = 0, outliers = 0;
  for (const LensCalibration::Residual& r : calibration.residuals) {
    if (std::find(shown.begin(), shown.end(), r.view) == shown.end()) continue;
    if (r.view < 0 || std::size_t(r.view) >= views.size() || r.match < 0 ||
        std::size_t(r.match) >= views[std::size_t(r.view)].matches.size())
      throw Error(ErrorCode::invalid_argument, "a residual's point is not in the views", "draw residuals");
    const Eigen::Vector2d& px = views[std::size_t(r.view)].matches[std::size_t(r.match)].pixel;
    const Rgb& color = r.outlier ? kOutlier : kCounts;
    canvas.line(px - Eigen::Vector2d(arm, 0), px + Eigen::Vector2d(arm, 0), unit, color);
    canvas.line(px - Eigen::Vector2d(0, arm), px + Eigen::Vector2d(0, arm), unit, color);
    canvas.line(px, px + magnify * r.error, 1.2 * unit, kResidual);
    ++(r.outlier ? outliers : points);
  }
  std::vector<std::pair<std::string, Rgb>> rows{{std::to_string(points) + " points", points > 0 ? kCounts : kWhite}};
  if (outliers > 0) rows.emplace_back(std::to_string(outliers) + " outliers", kOutlier);
  char text[64];
  std::snprintf(text, sizeof text, "residuals x %.4g", magnify);
  if (points + outliers > 0) rows.emplace_back(text, kResidual);
  canvas.legend(rows, 10 * unit);
  return rgb;
}

}  // namespace lumihull::calib
