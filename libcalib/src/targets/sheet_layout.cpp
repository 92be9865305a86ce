#include "sheet_layout.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lumihull::calib {
namespace {

constexpr double kFoot = 24;  ///< bar and lines of text at the bottom, margin included

Eigen::Vector2d paper_size(Paper paper) {
  return paper == Paper::letter ? Eigen::Vector2d(215.9, 279.4) : Eigen::Vector2d(210, 297);
}

double foot(const SheetOptions& options) { return options.scale_bar || options.ids ? kFoot : kSheetMargin; }

/// Room that n targets side by side take, from one paper's edge to the other: what surrounds them is free, too.
struct Row {
  double spacing = 0;  ///< between centres
  double needed = 0;
};
Row row_of(const TargetDesign& design, int n, double room) {
  const double ink = ink_side_mm(design), quiet = quiet_mm(design);
  // Circles: a gap of one and a half pitches from centre to centre, so that neighbours do not go on with the lattice.
  const double gap =
      design.family.kind() == TargetKind::circles ? 1.5e3 * design.size_m - 2e3 * design.circle_radius_m() : 2 * quiet;
  const double margin = std::max(kSheetMargin, quiet);
  Row row;
  row.needed = n * ink + (n - 1) * gap + 2 * margin;
  row.spacing = std::clamp(0.5 * room, ink + gap, std::max(ink + gap, room - 2 * margin - ink));
  return row;
}

bool fits(const TargetDesign& design, const SheetOptions& options, SheetLayout* layout) {
  const Eigen::Vector2d paper = paper_size(options.paper);
  const int n = options.per_sheet == 4 ? 2 : 1;
  const double label = options.ids ? 6 : 0;  // between a target's quiet zone and what is below
  const double height = paper.y() - foot(options) + kSheetMargin - label;
  const Row across = row_of(design, n, paper.x());
  Row down = row_of(design, n, height);
  if (n == 2) {  // the upper targets' labels stand between the rows
    const double least = ink_side_mm(design) + 2 * quiet_mm(design) + label;
    down.needed += std::max(0., least - down.spacing);
    down.spacing = std::max(down.spacing, least);
  }
  if (across.needed > paper.x() || down.needed > height) return false;
  if (!layout) return true;
  layout->width = paper.x();
  layout->height = paper.y();
  layout->label_below = quiet_mm(design) + 4;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column)
      layout->centers.emplace_back(0.5 * paper.x() + (column - 0.5 * (n - 1)) * across.spacing,
                                   0.5 * height + (row - 0.5 * (n - 1)) * down.spacing);
  return true;
}

/// The largest of step, 2 step, … that a test allows; 0: none.
template <class Fits>
double largest(double step, Fits fit) {
  int n = 0;
  while (n < 10'000 && fit((n + 1) * step)) ++n;
  return n * step;
}

bool fits(const PointGrid& grid, const SheetOptions& options, SheetLayout* layout) {
  constexpr double kAboveFoot = 6;
  const Eigen::Vector2d half = ink_half_mm(grid);
  for (const bool across : {half.x() > half.y(), half.x() <= half.y()}) {
    Eigen::Vector2d paper = paper_size(options.paper);
    if (across) std::swap(paper.x(), paper.y());
    const double bottom = paper.y() - foot(options) - (foot(options) > kSheetMargin ? kAboveFoot : 0);
    if (2 * (half.x() + kSheetMargin) > paper.x() || 2 * half.y() > bottom - kSheetMargin) continue;
    if (layout) *layout = {paper.x(), paper.y(), {{0.5 * paper.x(), 0.5 * (kSheetMargin + bottom)}}, 0};
    return true;
  }
  return false;
}

}  // namespace

std::string millimetres(double length_m) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g mm", length_m * 1e3);
  return text;
}

double ink_side_mm(const TargetDesign& design) {
  if (design.family.kind() == TargetKind::square) return 1e3 * design.size_m;
  return 1e3 * ((design.family.grid() - 1) * design.size_m + 2 * design.circle_radius_m());
}

double quiet_mm(const TargetDesign& design) {
  return design.family.kind() == TargetKind::square ? 1e3 * design.size_m / design.family.grid() : 250 * design.size_m;
}

double default_size_m(const TargetDesign& design, int per_sheet) {
  const double room = per_sheet == 4 ? 82.5 : 165;
  return largest(1,
                 [&](double size) {
                   TargetDesign sized = design;
                   sized.size_m = size / 1000;
                   const double margin = design.family.kind() == TargetKind::square ? 2 * quiet_mm(sized) : 0;
                   return ink_side_mm(sized) + margin <= room + 1e-9;
                 }) /
         1000;
}

SheetLayout lay_out_targets(const TargetDesign& design, const SheetOptions& options) {
  SheetLayout layout;
  if (fits(design, options, &layout)) return layout;
  const double size = largest(0.5, [&](double mm) {
    TargetDesign smaller = design;
    const double ratio = 1e-3 * mm / design.size_m;
    smaller.size_m *= ratio;
    smaller.circle_diameter_m *= ratio;
    return fits(smaller, options, nullptr);
  });
  throw Error(ErrorCode::invalid_argument,
              millimetres(design.size_m) + " does not fit on the paper; the largest " +
                  (design.family.kind() == TargetKind::circles ? "pitch" : "side") + " is " + millimetres(1e-3 * size),
              design.family.name());
}

Eigen::Vector2d ink_half_mm(const PointGrid& grid) {
  const Eigen::Vector2d points = 500 * grid.spacing_m * Eigen::Vector2d(grid.columns - 1, grid.rows - 1);
  const double beyond = grid.kind == PointGrid::Kind::circles ? grid.circle_radius_m() : grid.spacing_m;
  return points + Eigen::Vector2d::Constant(1e3 * beyond);
}

double default_spacing_m(const PointGrid& grid, const SheetOptions& options) {
  return largest(0.5,
                 [&](double mm) {
                   PointGrid sized = grid;
                   sized.spacing_m = mm / 1000;
                   return fits(sized, options, nullptr);
                 }) /
         1000;
}

SheetLayout lay_out_grid(const PointGrid& grid, const SheetOptions& options) {
  SheetLayout layout;
  if (fits(grid, options, &layout)) return layout;
  PointGrid smaller = grid;
  smaller.circle_diameter_m = 0;
  throw Error(ErrorCode::invalid_argument,
              millimetres(grid.spacing_m) + " does not fit on the paper; the largest spacing is " +
                  millimetres(default_spacing_m(smaller, options)),
              grid.kind == PointGrid::Kind::circles ? "circles" : "chessboard");
}

}  // namespace lumihull::calib
