#include <lumihull/calib/target_sheet.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"
#include "target_structs.h"

using namespace lumihull;
using namespace lumihull::capi;
using calib::PointGrid;
using calib::TargetDesign;

namespace lumihull::capi {
namespace {

calib::Rgb color_from(uint32_t color, const char* name) {
  if (color > 0xFFFFFF) invalid("expected a colour 0xRRGGBB", name);
  return {uint8_t(color >> 16), uint8_t(color >> 8), uint8_t(color)};
}
uint32_t color_to(const calib::Rgb& c) { return uint32_t(c[0]) << 16 | uint32_t(c[1]) << 8 | c[2]; }

}  // namespace

TargetDesign design_from(const char* family, const lh_target_design* user, const char* name) {
  const lh_target_design d = read_struct(user, name);
  TargetDesign design;
  design.family = calib::TargetFamily::by_name(text(family, "family"));
  design.size_m = d.size_m;
  design.circle_diameter_m = d.circle_diameter_m;
  design.ring_diameter_m = d.ring_diameter_m;
  design.scale_x = or_default(d.scale_x, design.scale_x);
  design.scale_y = or_default(d.scale_y, design.scale_y);
  design.solid_light = d.solid_light != 0;
  if (d.has_colors) {
    design.ink = color_from(d.ink, "ink");
    design.paper = color_from(d.paper, "paper");
  } else if (design.family.kind() == calib::TargetKind::square) {
    design.ink = {0, 0, 0};
    design.paper = {255, 255, 255};
  }
  return design;
}

lh_target_design design_to(const TargetDesign& design) {
  lh_target_design d{};
  d.struct_size = sizeof d;
  d.size_m = design.size_m;
  d.circle_diameter_m = design.circle_diameter_m;
  d.ring_diameter_m = design.ring_diameter_m;
  d.scale_x = design.scale_x;
  d.scale_y = design.scale_y;
  d.solid_light = design.solid_light;
  d.has_colors = 1;
  d.ink = color_to(design.ink);
  d.paper = color_to(design.paper);
  return d;
}

PointGrid grid_from(const lh_point_grid* user, const char* name) {
  const lh_point_grid g = read_struct(&given(user, name), name);
  if (g.kind != LH_GRID_CIRCLES && g.kind != LH_GRID_CHESSBOARD)
    invalid("expected LH_GRID_CIRCLES or LH_GRID_CHESSBOARD, found " + std::to_string(g.kind), "kind");
  return {g.kind == LH_GRID_CIRCLES ? PointGrid::Kind::circles : PointGrid::Kind::chessboard, g.columns, g.rows,
          g.spacing_m, g.circle_diameter_m};
}

lh_point_grid grid_to(const PointGrid& grid) {
  return {sizeof(lh_point_grid), grid.kind == PointGrid::Kind::circles ? LH_GRID_CIRCLES : LH_GRID_CHESSBOARD,
          grid.columns,          grid.rows,
          grid.spacing_m,        grid.circle_diameter_m};
}

}  // namespace lumihull::capi

namespace {

struct Sheets {
  calib::SheetOptions options;
  std::vector<calib::SheetFormat> formats;
};

Sheets sheets_from(const lh_sheet_options* user) {
  const lh_sheet_options o = read_struct(user, "options");
  if (o.paper != LH_PAPER_LETTER && o.paper != LH_PAPER_A4)
    invalid("expected LH_PAPER_LETTER or LH_PAPER_A4, found " + std::to_string(o.paper), "paper");
  if (o.formats & ~(LH_SHEET_PDF | LH_SHEET_SVG))
    invalid("expected LH_SHEET_PDF, LH_SHEET_SVG or both, found " + std::to_string(o.formats), "formats");
  Sheets sheets;
  sheets.options.paper = o.paper == LH_PAPER_A4 ? calib::Paper::a4 : calib::Paper::letter;
  sheets.options.per_sheet = or_default(int(o.per_sheet), sheets.options.per_sheet);
  sheets.options.paint_paper = o.paint_paper != 0;
  sheets.options.ids = o.no_text == 0;
  sheets.options.scale_bar = o.no_bar == 0;
  const int32_t formats = or_default(o.formats, LH_SHEET_PDF);
  if (formats & LH_SHEET_PDF) sheets.formats.push_back(calib::SheetFormat::pdf);
  if (formats & LH_SHEET_SVG) sheets.formats.push_back(calib::SheetFormat::svg);
  return sheets;
}

}  // namespace

lh_status lh_target_sheets_write(lh_context* ctx, const char* stem, const char* family, const lh_target_design* user,
                                 const int32_t* ids, size_t n, const lh_sheet_options* options, lh_target_set** out) {
  return guarded(ctx, [&](Job& job) {
    const TargetDesign design = design_from(family, user, "design");
    const Sheets sheets = sheets_from(options);
    const auto wanted = array(ids, n, 1, "ids");
    calib::TargetSet set = calib::write_target_sheets(path(stem, "stem"), design, {wanted.begin(), wanted.end()},
                                                      sheets.formats, sheets.options, job);
    if (out) give(out, std::move(set));
  });
}

lh_status lh_grid_sheet_write(lh_context* ctx, const char* stem, const lh_point_grid* grid,
                              const lh_sheet_options* options, lh_target_set** out) {
  return guarded(ctx, [&] {
    const Sheets sheets = sheets_from(options);
    calib::TargetSet set =
        calib::write_grid_sheet(path(stem, "stem"), grid_from(grid, "grid"), sheets.formats, sheets.options);
    if (out) give(out, std::move(set));
  });
}
