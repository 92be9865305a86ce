#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

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

}  // namespace

FlatPrint print_of(const TargetDesign& design, int id) {
  design.validate();
  const auto cells = design.family.cells(id);
  const int n = design.family.grid();
  const Vector3f ink = linear(design.ink), paper = linear(design.paper);
  const Vector3f light = paper.cwiseMax(.85f);  // bare white paper amid what is printed as the paper's colour
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
  print.stretch = {design.scale_x, design.scale_y};
  return print;
}

}  // namespace lumihull::rig
