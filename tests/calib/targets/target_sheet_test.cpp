// Printed sheets: what an independent program makes of them is where the file beside them says, and reads as the ids.
#include <lumihull/base/files.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/target_sheet.h>

#include <cmath>
#include <cstdio>
#include <numeric>

#include "rasterised.h"
#include "support.h"

#define LUMIHULL_NEED_PDFTOPPM() \
  if (!test::has_pdftoppm()) GTEST_SKIP() << "needs pdftoppm: install poppler-utils"

namespace lumihull::calib {
namespace {

using test::Page;
using testing::HasSubstr;

constexpr int kPaper = 255;

TargetDesign design_of(const std::string& family, double size_m = 0) {
  TargetDesign design;
  design.family = TargetFamily::by_name(family);
  design.size_m = size_m;
  design.ink = {0, 0, 0};
  return design;
}

std::vector<int> all_ids(const TargetDesign& design) {
  return {design.family.ids().begin(), design.family.ids().end()};
}

/// Where feature i of a board's target is on the page, mm.
Eigen::Vector2d place_mm(const TargetSet& set, const BoardTarget& target, int i) {
  const TargetDesign& design = set.designs[std::size_t(target.design)];
  const Eigen::Vector2d feature = design.feature(i);
  return 1e3 * (target.board_from_target * Eigen::Vector3d(feature.x(), feature.y(), 0)).head<2>();
}

/// The middle of the ink within a square of that half-width about a place, px.
Eigen::Vector2d middle_of_ink(const Page& page, const Eigen::Vector2d& about_px, double half_px, int ink_grey) {
  Eigen::Vector2d sum(0, 0);
  double total = 0;
  for (int row = int(about_px.y() - half_px); row < int(about_px.y() + half_px); ++row)
    for (int column = int(about_px.x() - half_px); column < int(about_px.x() + half_px); ++column) {
      const double ink = page.ink(column, row, kPaper, ink_grey);
      sum += ink * Eigen::Vector2d(column + 0.5, row + 0.5);
      total += ink;
    }
  return sum / total;
}

TEST(TargetSheet, CirclesAreWhereTheFileSays) {
  LUMIHULL_NEED_PDFTOPPM();
  const test::TemporaryFolder folder;
  Job job;
  for (const Paper paper : {Paper::letter, Paper::a4})
    for (const int per_sheet : {1, 4}) {
      SCOPED_TRACE(std::to_string(int(paper)) + ", " + std::to_string(per_sheet));
      write_target_sheets(folder / "sheet", design_of("matrix5x5"), {46, 200, 3, 255, 17}, {SheetFormat::pdf},
                          {.paper = paper, .per_sheet = per_sheet}, job);
      const TargetSet set = TargetSet::load(folder / "sheet.json");
      const auto pages = test::rasterised(folder / "sheet.pdf", 150);
      ASSERT_EQ(pages.size(), per_sheet == 1 ? 5u : 2u);
      ASSERT_EQ(set.boards.size(), pages.size());
      EXPECT_NEAR(pages[0].width, paper == Paper::letter ? 1275 : 1240, 1);
      EXPECT_NEAR(pages[0].height, paper == Paper::letter ? 1650 : 1754, 1);
      const TargetDesign& design = set.designs[0];
      EXPECT_DOUBLE_EQ(design.size_m, per_sheet == 1 ? 0.036 : 0.018);
      double worst = 0;
      for (std::size_t b = 0; b < pages.size(); ++b)
        for (const BoardTarget& target : set.boards[b].targets)
          for (int i = 0; i < design.features(); ++i) {
            const Eigen::Vector2d at = place_mm(set, target, i) / 25.4 * 150;
            const double half = 0.75 * pages[b].px(500 * design.size_m);
            worst = std::max(worst, (middle_of_ink(pages[b], at, half, 0) - at).norm());
          }
      EXPECT_LT(worst, 0.1);  // px, 0.017 mm
    }
}

TEST(TargetSheet, TheBarIsAsLongAsItSays) {
  LUMIHULL_NEED_PDFTOPPM();
  const test::TemporaryFolder folder;
  Job job;
  write_target_sheets(folder / "sheet", design_of("matrix6x6"), {0}, {SheetFormat::pdf}, {.paper = Paper::a4}, job);
  const Page page = test::rasterised(folder / "sheet.pdf", 300).at(0);
  double longest = 0;
  for (int row = page.height / 2; row < page.height; ++row) {
    double ink = 0;
    for (int column = 0; column < page.width; ++column) ink += page.ink(column, row, kPaper, 0);
    longest = std::max(longest, ink);
  }
  EXPECT_NEAR(longest / 300 * 25.4, 150, 0.01);
}

/// Reads a target's cells where the file says they are. Circles: their middles; squares: the cells' middles.
std::vector<Cell> read_back(const Page& page, const TargetSet& set, const BoardTarget& target) {
  const TargetDesign& design = set.designs[0];
  const int grid = design.family.grid();
  std::vector<Cell> cells;
  for (int i = 0; i < grid * grid; ++i) {
    Eigen::Vector2d at;
    if (design.family.kind() == TargetKind::circles) {
      at = place_mm(set, target, i);
    } else {
      const double u = (i % grid + 0.5) / grid, v = (i / grid + 0.5) / grid;
      const Eigen::Vector2d low = place_mm(set, target, 0), high = place_mm(set, target, 2);
      at = low + Eigen::Vector2d(u * (high - low).x(), v * (high - low).y());
    }
    cells.push_back(page.at(at.x(), at.y()) > 127 ? Cell::light : Cell::dark);
  }
  return cells;
}

/// Prints ids, four on a sheet, and reads their cells from the raster.
void expect_right_ids(const TargetDesign& design, const std::vector<int>& ids) {
  SCOPED_TRACE(design.family.name());
  const test::TemporaryFolder folder;
  Job job;
  write_target_sheets(folder / "sheets", design, ids, {SheetFormat::pdf}, {.per_sheet = 4}, job);
  const TargetSet set = TargetSet::load(folder / "sheets.json");
  const auto pages = test::rasterised(folder / "sheets.pdf", 24);
  ASSERT_EQ(pages.size(), (ids.size() + 3) / 4);
  ASSERT_EQ(set.boards.size(), pages.size());
  std::size_t next = 0;
  for (std::size_t b = 0; b < pages.size(); ++b)
    for (const BoardTarget& target : set.boards[b].targets) {
      ASSERT_EQ(target.id, ids[next++]);
      const std::vector<Cell> cells = read_back(pages[b], set, target);
      ASSERT_EQ(cells, design.family.cells(target.id)) << target.id;
      if (design.family.kind() != TargetKind::circles) continue;
      const auto read = design.family.decode(cells);
      ASSERT_TRUE(read);
      ASSERT_EQ(read->id, target.id);
      ASSERT_EQ(read->quarter_turns, 0);
    }
  EXPECT_EQ(next, ids.size());
}

TEST(TargetSheet, EveryIdOfEveryCircleFamilyIsRight) {
  LUMIHULL_NEED_PDFTOPPM();
  for (const char* family : {"paper4x4", "matrix5x5", "matrix6x6"}) {
    const TargetDesign design = design_of(family);
    expect_right_ids(design, all_ids(design));
  }
}

TEST(TargetSheet, SquareFamiliesAreRight) {
  LUMIHULL_NEED_PDFTOPPM();
  for (const std::string& family : TargetFamily::names()) {
    const TargetDesign design = design_of(family);
    if (design.family.kind() != TargetKind::square) continue;
    std::vector<int> ids = all_ids(design);
    ids.erase(ids.begin() + 8, ids.end() - 8);
    expect_right_ids(design, ids);
  }
}

TEST(TargetSheet, PaintedPaperFillsThePageAndLightCirclesAreLighter) {
  LUMIHULL_NEED_PDFTOPPM();
  const test::TemporaryFolder folder;
  Job job;
  TargetDesign design = design_of("paper4x4");
  design.solid_light = true;
  design.paper = {128, 128, 128};
  EXPECT_EQ(test::expect_error([&] {
              write_target_sheets(folder / "sheet", design, {46}, {SheetFormat::pdf}, {}, job);
            }).subject(),
            "solid_light");
  write_target_sheets(folder / "sheet", design, {46}, {SheetFormat::pdf}, {.paint_paper = true}, job);
  const TargetSet set = TargetSet::load(folder / "sheet.json");
  EXPECT_TRUE(set.designs[0].solid_light);
  const Page page = test::rasterised(folder / "sheet.pdf", 50).at(0);
  for (const double x : {0.3, 215.5})
    for (const double y : {0.3, 279.0}) EXPECT_NEAR(page.at(x, y), 128, 1);
  const auto cells = design.family.cells(46);
  for (int i = 0; i < 16; ++i) {
    const Eigen::Vector2d at = place_mm(set, set.boards[0].targets[0], i);
    EXPECT_EQ(page.at(at.x(), at.y()), cells[std::size_t(i)] == Cell::light ? 255 : 0) << i;
  }
}

TEST(TargetSheet, ScaledDesignsSayTrueLengths) {
  const test::TemporaryFolder folder;
  Job job;
  TargetDesign design = design_of("matrix5x5", 0.03);
  const auto drawn = write_target_sheets(folder / "a", design, {1}, {SheetFormat::svg}, {}, job);
  design.scale_x = 1.01;
  design.scale_y = 0.99;
  const auto scaled = write_target_sheets(folder / "b", design, {1}, {SheetFormat::svg}, {}, job);
  EXPECT_EQ(read_file(folder / "a-1.svg"), read_file(folder / "b-1.svg"));
  for (const int i : {0, 7, 24}) {
    const Eigen::Vector2d a = place_mm(drawn, drawn.boards[0].targets[0], i);
    const Eigen::Vector2d b = place_mm(scaled, scaled.boards[0].targets[0], i);
    EXPECT_NEAR(b.x(), 1.01 * a.x(), 1e-9);
    EXPECT_NEAR(b.y(), 0.99 * a.y(), 1e-9);
  }
}

/// Circles of an SVG: all closed paths of two arcs.
struct Circle {
  double x, y, radius;
};
std::vector<Circle> circles_of(const std::string& svg) {
  std::vector<Circle> circles;
  for (std::size_t at = svg.find("d=\"M"); at != std::string::npos; at = svg.find("M", at + 1)) {
    double right, y, r, r2, left, y2;
    if (std::sscanf(svg.c_str() + svg.find('M', at), "M%lf %lfA%lf %lf 0 0 1 %lf %lfA", &right, &y, &r, &r2, &left,
                    &y2) == 6)
      circles.push_back({0.5 * (left + right), y, r});
    at = svg.find('M', at);
  }
  return circles;
}

TEST(TargetSheet, SvgIsExact) {
  const test::TemporaryFolder folder;
  Job job;
  const TargetSet set = write_target_sheets(folder / "sheet", design_of("matrix6x6"), {7, 4095, 12}, {SheetFormat::svg},
                                            {.paper = Paper::a4}, job);
  for (std::size_t page = 0; page < 3; ++page) {
    const std::string svg = read_file(folder / ("sheet-" + std::to_string(page + 1) + ".svg"));
    EXPECT_THAT(svg, HasSubstr("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""));
    EXPECT_THAT(svg, HasSubstr(">id " + std::to_string(set.boards[page].targets[0].id) + "<"));
    const auto circles = circles_of(svg);
    const BoardTarget& target = set.boards[page].targets[0];
    const auto cells = set.designs[0].family.cells(target.id);
    for (int i = 0; i < 36; ++i) {
      const Eigen::Vector2d at = place_mm(set, target, i);
      std::vector<double> radii;
      for (const Circle& c : circles)
        if (std::hypot(c.x - at.x(), c.y - at.y()) < 2e-4) radii.push_back(c.radius);
      if (cells[std::size_t(i)] == Cell::light)
        EXPECT_THAT(radii, testing::ElementsAre(testing::DoubleNear(7.5, 1e-4), testing::DoubleNear(4.125, 1e-4)));
      else
        EXPECT_THAT(radii, testing::ElementsAre(testing::DoubleNear(7.5, 1e-4)));
    }
  }
}

TEST(TargetSheet, DefaultSizesAreThoseOfTheManual) {
  const test::TemporaryFolder folder;
  Job job;
  for (const auto& [family, one, four] : {std::tuple("matrix5x5", 0.036, 0.018), std::tuple("matrix6x6", 0.030, 0.015),
                                          std::tuple("paper4x4", 0.047, 0.023)})
    for (const Paper paper : {Paper::letter, Paper::a4}) {
      const auto size = [&](int per_sheet) {
        return write_target_sheets(folder / "s", design_of(family), {46}, {SheetFormat::svg},
                                   {.paper = paper, .per_sheet = per_sheet}, job)
            .designs[0]
            .size_m;
      };
      EXPECT_DOUBLE_EQ(size(1), one) << family;
      EXPECT_DOUBLE_EQ(size(4), four) << family;
    }
  for (const std::string& family : TargetFamily::names())
    for (const int per_sheet : {1, 4}) {
      const TargetDesign design = design_of(family);
      const auto set = write_target_sheets(folder / "s", design, {design.family.ids().front()}, {SheetFormat::svg},
                                           {.per_sheet = per_sheet}, job);
      EXPECT_GT(set.designs[0].size_m, per_sheet == 1 ? 0.02 : 0.01) << family;
    }
}

TEST(TargetSheet, ChessboardCornersAreWhereTheyShouldBe) {
  LUMIHULL_NEED_PDFTOPPM();
  const test::TemporaryFolder folder;
  const TargetSet set =
      write_grid_sheet(folder / "board", {PointGrid::Kind::chessboard, 9, 6, 0.025, 0}, {SheetFormat::pdf}, {});
  ASSERT_EQ(set.grids.size(), 1u);
  EXPECT_TRUE(set.boards.empty());
  const Page page = test::rasterised(folder / "board.pdf", 150).at(0);
  EXPECT_EQ(page.width, 1650);  // across
  // Ink of a row through the first row of fields, and of a column through the first column: 5 fields of 25 mm and 4.
  const auto span = [&](bool row, int at) {
    double ink = 0;
    for (int i = 0; i < (row ? page.width : page.height * 9 / 10); ++i)
      ink += row ? page.ink(i, at, kPaper, 0) : page.ink(at, i, kPaper, 0);
    return ink / 150 * 25.4;
  };
  const int first_row = int(page.px(10 + 12)), first_column = int(page.px((279.4 - 250) / 2 + 12));
  EXPECT_NEAR(span(true, first_row), 5 * 25, 0.06);  // ten edges; 0.01 mm is a fifteenth of a pixel
  EXPECT_NEAR(span(false, first_column), 4 * 25, 0.06);
}

TEST(TargetSheet, FieldsOfCirclesAreAsLargeAsFits) {
  LUMIHULL_NEED_PDFTOPPM();
  const test::TemporaryFolder folder;
  PointGrid grid{PointGrid::Kind::circles, 11, 8, 0, 0};
  const TargetSet set = write_grid_sheet(folder / "board", grid, {SheetFormat::pdf}, {.paper = Paper::a4});
  const double spacing = 1e3 * set.grids[0].spacing_m;
  EXPECT_GT(spacing, 20);
  const Page page = test::rasterised(folder / "board.pdf", 150).at(0);
  // The field is in the middle of the width; its first row is found by its ink.
  const double left = 0.5 * (297 - 10 * spacing);
  int row = 0;
  while (page.at(left, 25.4 * row / 150) > 127) ++row;
  const Eigen::Vector2d first(page.px(left), row + page.px(0.25 * spacing));
  const Eigen::Vector2d origin = middle_of_ink(page, first, page.px(0.4 * spacing), 0);
  for (int i = 0; i < 88; ++i) {
    const Eigen::Vector2d at = origin + set.grids[0].point(i) * 1e3 / 25.4 * 150;
    EXPECT_LT((middle_of_ink(page, at, page.px(0.4 * spacing), 0) - at).norm(), 0.1) << i;
  }
}

TEST(TargetSheet, TheSameArgumentsGiveTheSameBytes) {
  const test::TemporaryFolder folder;
  Job job;
  for (const char* name : {"a", "b"})
    write_target_sheets(folder / name, design_of("matrix5x5"), {1, 2, 3}, {SheetFormat::svg, SheetFormat::pdf}, {},
                        job);
  for (const char* ending : {".pdf", ".json", "-1.svg", "-3.svg"})
    EXPECT_EQ(read_file(folder / (std::string("a") + ending)), read_file(folder / (std::string("b") + ending)))
        << ending;
  EXPECT_FALSE(std::filesystem::exists(folder / "a-4.svg"));
}

TEST(TargetSheet, ACancelledRunLeavesNoPdf) {
  const test::TemporaryFolder folder;
  Job* running = nullptr;
  Job job([&](const Progress& progress) {
    if (progress.done > 0) running->cancel();
  });
  running = &job;
  const TargetDesign design = design_of("matrix6x6");
  EXPECT_EQ(test::expect_error([&] {
              write_target_sheets(folder / "sheets", design, all_ids(design), {SheetFormat::pdf}, {}, job);
            }).code(),
            ErrorCode::cancelled);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(TargetSheet, RefusesWhatCannotBePrinted) {
  const test::TemporaryFolder folder;
  Job job;
  const auto refusal = [&](const TargetDesign& design, const std::vector<int>& ids,
                           const std::vector<SheetFormat>& formats, const SheetOptions& options) {
    const Error e = test::expect_error([&] { write_target_sheets(folder / "s", design, ids, formats, options, job); });
    EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    return e.message();
  };
  const std::vector<SheetFormat> pdf{SheetFormat::pdf};
  const TargetDesign five = design_of("matrix5x5");
  EXPECT_THAT(refusal(five, {}, pdf, {}), HasSubstr("at least one id"));
  EXPECT_THAT(refusal(five, {256}, pdf, {}), HasSubstr("256 from 0 to 255"));
  EXPECT_THAT(refusal(five, {1, 2, 1}, pdf, {}), HasSubstr("twice"));
  EXPECT_THAT(refusal(five, {1}, {}, {}), HasSubstr("format"));
  EXPECT_THAT(refusal(five, {1}, pdf, {.per_sheet = 2}), HasSubstr("1 or 4"));
  EXPECT_THAT(refusal(design_of("matrix5x5", 0.05), {1}, pdf, {}), HasSubstr("the largest pitch is "));
  EXPECT_THAT(refusal(design_of("matrix5x5", NAN), {1}, pdf, {}), HasSubstr("size"));
  EXPECT_THAT(refusal(design_of("apriltag:36h11", 0.2), {1}, pdf, {.per_sheet = 4}), HasSubstr("the largest side is "));
  TargetDesign pale = five;
  pale.ink = pale.paper;
  EXPECT_THAT(refusal(pale, {1}, pdf, {}), HasSubstr("darker"));
  EXPECT_EQ(
      test::expect_error([&] { write_target_sheets(folder / "no", five, {1}, pdf, {.paper = Paper(7)}, job); }).code(),
      ErrorCode::invalid_argument);
  EXPECT_EQ(
      test::expect_error([&] { write_target_sheets(folder.path() / "absent" / "s", five, {1}, pdf, {}, job); }).code(),
      ErrorCode::not_found);

  const auto grid_refusal = [&](const PointGrid& grid) {
    return std::string(test::expect_error([&] { write_grid_sheet(folder / "s", grid, pdf, {}); }).what());
  };
  EXPECT_THAT(grid_refusal({PointGrid::Kind::chessboard, 9, 6, 0.04, 0}), HasSubstr("the largest spacing is 25 mm"));
  EXPECT_THAT(grid_refusal({PointGrid::Kind::chessboard, 1, 6, 0, 0}), HasSubstr("/grids/0/columns"));
  EXPECT_THAT(grid_refusal({PointGrid::Kind::circles, 9, 6, 0, 0.01}), HasSubstr("circle_diameter_m"));
  EXPECT_THAT(grid_refusal({PointGrid::Kind::circles, 9, 6, -1, 0}), HasSubstr("/grids/0/spacing_m"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace lumihull::calib
