#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <algorithm>
#include <functional>
#include <set>

#include "cell_outlines.h"
#include "sheet_canvas.h"
#include "sheet_layout.h"

namespace lumihull::calib {
namespace {

constexpr double kTextHeight = 3;

/// A target's ink about a centre.
void draw_circles(SheetCanvas& canvas, const TargetDesign& design, int id, const Eigen::Vector2d& center) {
  const std::vector<Cell> cells = design.family.cells(id);
  const int grid = design.family.grid();
  const double pitch = 1e3 * design.size_m, middle = 0.5 * (grid - 1);
  const double outer = 1e3 * design.circle_radius_m(), inner = 1e3 * design.ring_radius_m();
  const auto each = [&](Cell kind, auto draw) {
    for (int i = 0; i < grid * grid; ++i)
      if (cells[std::size_t(i)] == kind)
        draw(center.x() + (i % grid - middle) * pitch, center.y() + (i / grid - middle) * pitch);
  };
  if (design.solid_light) {  // unprinted discs in the painted paper
    each(Cell::light, [&](double x, double y) { canvas.add_circle(x, y, outer); });
    canvas.fill({255, 255, 255});
  } else {
    each(Cell::light, [&](double x, double y) {
      canvas.add_circle(x, y, outer);
      canvas.add_circle(x, y, inner);
    });
  }
  each(Cell::dark, [&](double x, double y) { canvas.add_circle(x, y, outer); });
  canvas.fill(design.ink);
}

void draw_square(SheetCanvas& canvas, const TargetDesign& design, int id, const Eigen::Vector2d& center) {
  const int grid = design.family.grid();
  const double side = 1e3 * design.size_m, module = side / grid;
  const Eigen::Vector2d corner = center - Eigen::Vector2d::Constant(0.5 * side);
  for (const auto& outline : dark_outlines(design.family.cells(id), grid)) {
    std::vector<Eigen::Vector2d> polygon;
    for (const Eigen::Vector2i& point : outline) polygon.push_back(corner + module * point.cast<double>());
    canvas.add_polygon(polygon);
  }
  canvas.fill(design.ink);
}

void draw_grid(SheetCanvas& canvas, const PointGrid& grid, const Eigen::Vector2d& center, const Rgb& ink) {
  const double spacing = 1e3 * grid.spacing_m;
  const Eigen::Vector2d first = center - 0.5 * spacing * Eigen::Vector2d(grid.columns - 1, grid.rows - 1);
  if (grid.kind == PointGrid::Kind::circles) {
    for (int i = 0; i < grid.columns * grid.rows; ++i)
      canvas.add_circle(first.x() + i % grid.columns * spacing, first.y() + i / grid.columns * spacing,
                        1e3 * grid.circle_radius_m());
  } else {
    for (int row = 0; row <= grid.rows; ++row)
      for (int column = row % 2; column <= grid.columns; column += 2)  // the top left field is dark
        canvas.add_rectangle(first.x() + (column - 1) * spacing, first.y() + (row - 1) * spacing, spacing, spacing);
  }
  canvas.fill(ink);
}

void draw_bar(SheetCanvas& canvas, const SheetLayout& sheet, const Rgb& ink) {
  constexpr double kThick = 1, kTick = 0.4, kTickHeight = 4;
  const double left = 0.5 * (sheet.width - kBarLength), y = sheet.height - 17;
  canvas.add_rectangle(left + kTick, y - 0.5 * kThick, kBarLength - 2 * kTick, kThick);
  for (const double x : {left, left + kBarLength - kTick})
    canvas.add_rectangle(x, y - 0.5 * kTickHeight, kTick, kTickHeight);
  canvas.fill(ink);
  canvas.text(0.5 * sheet.width, sheet.height - 11, kTextHeight,
              "150.0 mm. Print at 100 % (actual size), then measure this bar.", ink, SheetCanvas::Anchor::middle);
}

using DrawPage = std::function<void(SheetCanvas&, std::size_t page)>;

void paint(SheetCanvas& canvas, const SheetLayout& sheet, const Rgb& paper) {
  canvas.add_rectangle(0, 0, sheet.width, sheet.height);
  canvas.fill(paper);
}

void write_pdf(const std::filesystem::path& stem, const SheetLayout& sheet, const std::string& title, std::size_t pages,
               const DrawPage& draw, const std::function<void()>& page_done) {
  AtomicFile file(stem.string() + ".pdf");
  const auto canvas =
      make_pdf_canvas(sheet.width, sheet.height, title, [&](std::string_view bytes) { file.write(bytes); });
  for (std::size_t page = 0; page < pages; ++page) {
    draw(*canvas, page);
    canvas->end_page();
    page_done();
  }
  canvas->finish();
  file.commit();
}

void write_svgs(const std::filesystem::path& stem, const SheetLayout& sheet, const std::string& title,
                std::size_t pages, const DrawPage& draw, const std::function<void()>& page_done) {
  for (std::size_t page = 0; page < pages; ++page) {
    std::string bytes;
    const auto canvas =
        make_svg_canvas(sheet.width, sheet.height, title, [&](std::string_view more) { bytes += more; });
    draw(*canvas, page);
    canvas->finish();
    write_file(stem.string() + "-" + std::to_string(page + 1) + ".svg", bytes);
    page_done();
  }
}

void write_formats(const std::filesystem::path& stem, const std::vector<SheetFormat>& formats, const SheetLayout& sheet,
                   const std::string& title, std::size_t pages, const DrawPage& draw,
                   const std::function<void()>& page_done) {
  for (const SheetFormat format : {SheetFormat::pdf, SheetFormat::svg})
    if (std::find(formats.begin(), formats.end(), format) != formats.end())
      (format == SheetFormat::pdf ? write_pdf : write_svgs)(stem, sheet, title, pages, draw, page_done);
}

void check_formats(const std::filesystem::path& stem, const std::vector<SheetFormat>& formats) {
  if (formats.empty()) throw Error(ErrorCode::invalid_argument, "expected at least one format", "formats");
  for (const SheetFormat format : formats)
    if (format != SheetFormat::pdf && format != SheetFormat::svg)
      throw Error(ErrorCode::invalid_argument, "expected pdf or svg", "formats");
  if (!stem.has_filename()) throw Error(ErrorCode::invalid_argument, "expected a file name without its ending", "stem");
}

void check_ids(const TargetFamily& family, std::vector<int> ids) {
  if (ids.empty()) throw Error(ErrorCode::invalid_argument, "expected at least one id", "ids");
  std::sort(ids.begin(), ids.end());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!family.has(ids[i]))
      throw Error(ErrorCode::invalid_argument,
                  family.name() + " has no id " + std::to_string(ids[i]) + "; it has " +
                      std::to_string(family.ids().size()) + " from " + std::to_string(family.ids().front()) + " to " +
                      std::to_string(family.ids().back()),
                  "ids");
    if (i > 0 && ids[i] == ids[i - 1])
      throw Error(ErrorCode::invalid_argument, "id " + std::to_string(ids[i]) + " is there twice", "ids");
  }
}

/// "matrix5x5, pitch 36 mm, circles 18 mm".
std::string described(const TargetDesign& design) {
  if (design.family.kind() == TargetKind::square)
    return design.family.name() + ", black square " + millimetres(design.size_m);
  return design.family.name() + ", pitch " + millimetres(design.size_m) + ", circles " +
         millimetres(2 * design.circle_radius_m());
}

std::string described(const PointGrid& grid) {
  const bool circles = grid.kind == PointGrid::Kind::circles;
  std::string text = circles ? "circles, " : "chessboard, ";
  text += std::to_string(grid.columns) + " x " + std::to_string(grid.rows);
  if (!circles) return text + " inner corners, squares of " + millimetres(grid.spacing_m);
  return text + ", spacing " + millimetres(grid.spacing_m) + ", diameter " + millimetres(2 * grid.circle_radius_m());
}

}  // namespace

void SheetOptions::validate() const {
  if (paper != Paper::letter && paper != Paper::a4)
    throw Error(ErrorCode::invalid_argument, "expected letter or A4", "paper");
  if (per_sheet != 1 && per_sheet != 4) throw Error(ErrorCode::invalid_argument, "expected 1 or 4", "per_sheet");
}

TargetSet write_target_sheets(const std::filesystem::path& stem, const TargetDesign& given, const std::vector<int>& ids,
                              const std::vector<SheetFormat>& formats, const SheetOptions& options, Job& job) {
  options.validate();
  check_formats(stem, formats);
  TargetDesign design = given;
  if (design.size_m == 0) design.size_m = default_size_m(design, options.per_sheet);
  design.validate();
  check_ids(design.family, ids);
  if (design.solid_light && !options.paint_paper)
    throw Error(ErrorCode::invalid_argument,
                "light circles without rings need the paper's colour to be printed around them", "solid_light");
  const SheetLayout sheet = lay_out_targets(design, options);
  const std::size_t per_sheet = std::size_t(options.per_sheet), pages = (ids.size() + per_sheet - 1) / per_sheet;

  TargetSet set;
  set.designs = {design};
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (i % per_sheet == 0) set.boards.push_back({"sheet " + std::to_string(i / per_sheet + 1), {}});
    const Eigen::Vector2d& center = sheet.centers[i % per_sheet];
    Pose board_from_target;
    board_from_target.translation = {center.x() / 1000 * design.scale_x, center.y() / 1000 * design.scale_y, 0};
    set.boards.back().targets.push_back({0, ids[i], board_from_target});
  }

  const double half = 0.5 * ink_side_mm(design);
  const auto draw = [&](SheetCanvas& canvas, std::size_t page) {
    job.check();
    if (options.paint_paper) paint(canvas, sheet, design.paper);
    for (std::size_t i = page * per_sheet; i < std::min(ids.size(), (page + 1) * per_sheet); ++i) {
      const Eigen::Vector2d& center = sheet.centers[i % per_sheet];
      (design.family.kind() == TargetKind::circles ? draw_circles : draw_square)(canvas, design, ids[i], center);
      if (options.ids)
        canvas.text(center.x() - half, center.y() + half + sheet.label_below, kTextHeight,
                    "id " + std::to_string(ids[i]), design.ink, SheetCanvas::Anchor::left);
    }
    if (options.ids)
      canvas.text(0.5 * sheet.width, sheet.height - 21, kTextHeight,
                  described(design) + ", sheet " + std::to_string(page + 1) + " of " + std::to_string(pages),
                  design.ink, SheetCanvas::Anchor::middle);
    if (options.scale_bar) draw_bar(canvas, sheet, design.ink);
  };
  job.begin("drawing sheets", pages * std::set<SheetFormat>(formats.begin(), formats.end()).size());
  write_formats(stem, formats, sheet, described(design), pages, draw, [&] { job.advance(); });
  job.end();
  set.save(stem.string() + ".json");
  return set;
}

TargetSet write_grid_sheet(const std::filesystem::path& stem, const PointGrid& given,
                           const std::vector<SheetFormat>& formats, const SheetOptions& options, const Rgb& ink,
                           const Rgb& paper) {
  options.validate();
  check_formats(stem, formats);
  TargetSet set;
  set.grids = {given};
  PointGrid& grid = set.grids[0];
  if (given.spacing_m == 0) {
    if (given.circle_diameter_m != 0)
      throw Error(ErrorCode::invalid_argument, "expected none, for the spacing is still to be chosen",
                  "circle_diameter_m");
    grid.spacing_m = 1e-3;  // the rest is checked before it is chosen
    set.validate();
    grid.spacing_m = default_spacing_m(grid, options);
  }
  set.validate();
  TargetDesign colors;
  colors.ink = ink;
  colors.paper = paper;
  colors.validate();
  const SheetLayout sheet = lay_out_grid(grid, options);
  const auto draw = [&](SheetCanvas& canvas, std::size_t) {
    if (options.paint_paper) paint(canvas, sheet, paper);
    draw_grid(canvas, grid, sheet.centers[0], ink);
    if (options.ids)
      canvas.text(0.5 * sheet.width, sheet.height - 21, kTextHeight, described(grid), ink, SheetCanvas::Anchor::middle);
    if (options.scale_bar) draw_bar(canvas, sheet, ink);
  };
  write_formats(stem, formats, sheet, described(grid), 1, draw, [] {});
  set.save(stem.string() + ".json");
  return set;
}

}  // namespace lumihull::calib
