#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <cmath>
#include <utility>

#include "flat_shapes.h"

namespace lumihull::rig {

namespace {

using calib::Cell;
using calib::TargetDesign;
using Eigen::Vector2d;
using Eigen::Vector3f;

Vector3f linear(const calib::Rgb& c) {
  return {linear_from_srgb(float(c[0]) / 255.f), linear_from_srgb(float(c[1]) / 255.f),
          linear_from_srgb(float(c[2]) / 255.f)};
}

/// Corners of a circle that the print's scale made an ellipse: enough for 1e-6 of its radius.
constexpr int kEllipseCorners = 2048;

FlatShape scaled(FlatShape s, double x, double y) {
  const Vector2d scale(x, y);
  if (s.radius > 0 && x != y) {
    for (int i = 0; i < kEllipseCorners; ++i) {
      const double t = 2 * M_PI * i / kEllipseCorners;
      s.polygon.push_back((s.center + s.radius * Vector2d(std::cos(t), std::sin(t))).cwiseProduct(scale));
    }
    s.radius = 0;
    return s;
  }
  s.center = s.center.cwiseProduct(scale), s.radius *= x;
  for (Vector2d& p : s.polygon) p = p.cwiseProduct(scale);
  return s;
}

}  // namespace

FlatPrint print_of(const TargetDesign& design, int id) {
  design.validate();
  const auto cells = design.family.cells(id);
  const int n = design.family.grid();
  const Vector3f ink = linear(design.ink), paper = linear(design.paper);
  const Vector3f light = paper + .6f * (Vector3f::Ones() - paper);  // what is lighter than the paper
  FlatPrint print;
  print.paper = paper;
  if (design.family.kind() == calib::TargetKind::circles) {
    const double pitch = design.size_m, half = .5 * (n + 1) * pitch;
    print.low = {-half, -half}, print.high = {half, half};
    for (int i = 0; i < n * n; ++i) {
      const Vector2d center = Vector2d(i % n - .5 * (n - 1), i / n - .5 * (n - 1)) * pitch;
      const bool ring = cells[std::size_t(i)] == Cell::light;
      print.shapes.push_back(disc(center, design.circle_radius_m(), ring && design.solid_light ? light : ink));
      if (ring && !design.solid_light) print.shapes.push_back(disc(center, design.ring_radius_m(), paper));
    }
  } else {
    const double module = design.size_m / n, half = .5 * design.size_m;
    const Vector2d corner(-half, -half);
    print.low = {-half - 2 * module, -half - 2 * module}, print.high = -print.low;
    print.shapes.push_back(rectangle(corner, -corner, ink));
    for (int y = 0; y < n; ++y)  // runs of light cells
      for (int x = 0, end = 0; x < n; x = end + 1) {
        for (end = x; end < n && cells[std::size_t(y * n + end)] == Cell::light;) ++end;
        if (end > x)
          print.shapes.push_back(
              rectangle(corner + module * Vector2d(x, y), corner + module * Vector2d(end, y + 1), paper));
      }
  }
  const Vector2d scale(design.scale_x, design.scale_y);
  print.low = print.low.cwiseProduct(scale), print.high = print.high.cwiseProduct(scale);
  for (FlatShape& s : print.shapes) s = scaled(std::move(s), design.scale_x, design.scale_y);
  return print;
}

}  // namespace lumihull::rig
