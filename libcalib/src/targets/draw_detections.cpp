// What was found in a photograph, drawn into it.
#include <lumihull/base/error.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/detect_targets.h>
#include <lumihull/calib/ellipse.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "canvas.h"

namespace lumihull::calib {
namespace {

constexpr Rgb kContour{255, 214, 0}, kId{120, 255, 255}, kAxisX{255, 60, 40}, kAxisY{60, 230, 60}, kResidual{255, 0, 255},
    kRefused{255, 130, 0}, kWhite{255, 255, 255};

using Reason = RefusedTarget::Reason;
struct ReasonWord {
  Reason reason;
  char letter;
  const char* words;
};
constexpr std::array<ReasonWord, 6> kReasons{{{Reason::no_code, 'c', "no code"},
                                              {Reason::homography, 'h', "homography"},
                                              {Reason::duplicate, 'd', "duplicate"},
                                              {Reason::too_few_features, 'f', "too few features"},
                                              {Reason::unknown_id, 'u', "unknown id"},
                                              {Reason::overexposed, 'o', "overexposed"}}};

class Drawing {
 public:
  Drawing(Image& rgb, const TargetSet& set, double magnify)
      : canvas_(rgb), set_(set), magnify_(magnify), unit_(std::max(1.0, std::max(rgb.width(), rgb.height()) / 1600.0)) {}

  void target(const Detection& d) {
    const bool grid = d.id < 0;
    if (grid ? d.design < 0 || d.design >= int(set_.grids.size()) : d.design < 0 || d.design >= int(set_.designs.size()))
      throw Error(ErrorCode::invalid_argument, "a detection's design is not in the set", "detections");
    std::vector<Eigen::Vector2d> points;
    for (const Feature& f : d.features) {
      points.push_back(f.pixel);
      if (f.dual_conic(2, 2) == 0) continue;
      const auto ellipse = Ellipse::from_dual_conic(f.dual_conic / f.dual_conic(2, 2));
      if (ellipse) contour(*ellipse);
    }
    if (points.empty()) return;
    if (grid)
      canvas_.polyline(points, false, unit_, kContour);
    else if (set_.designs[std::size_t(d.design)].family.kind() == TargetKind::square)
      canvas_.polyline(points, points.size() == 4, 1.5 * unit_, kContour);
    frame(d, grid);
    for (const Feature& f : d.features) residual(d, f, grid);
    if (!grid) id(d.id, points);
  }

  void refused(const RefusedTarget& r) {
    const double half = std::max(4 * unit_, 0.5 * r.size_px);
    const auto word = std::find_if(kReasons.begin(), kReasons.end(), [&](const auto& w) { return w.reason == r.reason; });
    const std::array<Eigen::Vector2d, 4> box{r.pixel + Eigen::Vector2d(-half, -half), r.pixel + Eigen::Vector2d(half, -half),
                                             r.pixel + Eigen::Vector2d(half, half), r.pixel + Eigen::Vector2d(-half, half)};
    canvas_.polyline(box, true, unit_, kRefused);
    if (word == kReasons.end()) return;
    canvas_.text(box[0] + Eigen::Vector2d(2, 2) * unit_, std::string_view(&word->letter, 1), 8 * unit_, kRefused);
    ++counts_[std::size_t(word - kReasons.begin())];
  }

  void legend(std::size_t targets) {
    std::vector<std::pair<std::string, Rgb>> rows{{std::to_string(targets) + " targets", kWhite}};
    char text[64];
    std::snprintf(text, sizeof text, "residuals x %.4g", magnify_);
    if (targets > 0) rows.emplace_back(text, kResidual);
    for (std::size_t i = 0; i < kReasons.size(); ++i)
      if (counts_[i] > 0)
        rows.emplace_back(std::string(1, kReasons[i].letter) + ": " + std::to_string(counts_[i]) + " " + kReasons[i].words,
                          kRefused);
    canvas_.legend(rows, 10 * unit_);
  }

 private:
  void contour(const Ellipse& e) {
    const int pieces = std::clamp(int(4 * std::sqrt(e.a)) + 12, 16, 400);
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < pieces; ++i) points.push_back(e.point(2 * std::numbers::pi * i / pieces));
    canvas_.polyline(points, true, unit_, kContour);
  }

  /// The axes: from the middle of a target to where its outline is; one spacing long for a field of points.
  void frame(const Detection& d, bool grid) {
    double length = 0;
    if (grid)
      length = set_.grids[std::size_t(d.design)].spacing_m;
    else {
      const TargetDesign& design = set_.designs[std::size_t(d.design)];
      length = design.size_m * (design.family.kind() == TargetKind::square ? 0.5 : 0.5 * design.family.grid());
    }
    const auto seen = [&](double x, double y) -> Eigen::Vector2d {
      return (d.pixel_from_target * Eigen::Vector3d(x, y, 1)).hnormalized();
    };
    canvas_.line(seen(0, 0), seen(length, 0), 2 * unit_, kAxisX);
    canvas_.line(seen(0, 0), seen(0, length), 2 * unit_, kAxisY);
  }

  void residual(const Detection& d, const Feature& f, bool grid) {
    Eigen::Vector2d place;
    double radius = 0;
    if (grid) {
      const PointGrid& points = set_.grids[std::size_t(d.design)];
      place = points.point(f.index);
      if (points.kind == PointGrid::Kind::circles) radius = points.circle_radius_m();
    } else {
      const TargetDesign& design = set_.designs[std::size_t(d.design)];
      if (f.index < 0 || f.index >= design.features())
        throw Error(ErrorCode::invalid_argument, "a feature's index is not one of its design", "detections");
      place = design.feature(f.index);
      if (design.family.kind() == TargetKind::circles) radius = design.circle_radius_m();
    }
    const Eigen::Vector2d expected = homography_circle_center(d.pixel_from_target, place, radius);
    canvas_.dot(f.pixel, 1.2 * unit_, kResidual);
    canvas_.line(f.pixel, f.pixel + magnify_ * (f.pixel - expected), 1.2 * unit_, kResidual);
  }

  /// As high as a quarter of the target, but readable; in the middle.
  void id(int number, const std::vector<Eigen::Vector2d>& points) {
    Eigen::Vector2d low = points[0], high = points[0];
    for (const auto& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const double height = std::clamp(0.25 * (high - low).minCoeff(), 9 * unit_, 40 * unit_);
    const std::string text = std::to_string(number);
    const Eigen::Vector2d size(Canvas::text_width(text, height), height);
    canvas_.text(0.5 * (low + high - size), text, height, kId);
  }

  Canvas canvas_;
  const TargetSet& set_;
  double magnify_, unit_;  ///< unit: px that a thin line is wide
  std::array<int, kReasons.size()> counts_{};
};

}  // namespace

Image draw_detections(const Image& photo, const TargetSet& set, const Detections& found, double magnify) {
  if (photo.empty()) throw Error(ErrorCode::invalid_argument, "the picture is empty", "draw detections");
  if (!std::isfinite(magnify)) throw Error(ErrorCode::invalid_argument, "must be finite", "magnify");
  Image rgb = converted(photo, PixelType::u8, 3);
  Drawing drawing(rgb, set, magnify);
  for (const RefusedTarget& r : found.refused) drawing.refused(r);
  for (const Detection& d : found.targets) drawing.target(d);
  drawing.legend(found.targets.size());
  return rgb;
}

}  // namespace lumihull::calib
