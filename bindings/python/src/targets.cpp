// Targets: families, what was printed, sheets to print.
#include <lumihull/calib/target_sheet.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.h"

namespace lumihull::python {

using namespace py::literals;
using namespace lumihull::calib;

namespace {

const char* kind_name(PointGrid::Kind kind) { return kind == PointGrid::Kind::circles ? "circles" : "chessboard"; }

PointGrid::Kind grid_kind(const std::string& name) {
  if (name == "circles") return PointGrid::Kind::circles;
  if (name == "chessboard") return PointGrid::Kind::chessboard;
  invalid("expected \"circles\" or \"chessboard\"", "kind");
}

/// The points 0 … n - 1 of something as (n, 2).
template <class Point>
Array<double> points_of(int n, Point point) {
  Array<double> out({py::ssize_t(n), py::ssize_t(2)});
  for (int i = 0; i < n; ++i) Eigen::Map<Eigen::Vector2d>(out.mutable_data() + 2 * i) = point(i);
  return out;
}

void bind_family(py::module_& module) {
  py::class_<DecodedTarget>(module, "DecodedTarget", "What was read from a grid of cells.")
      .def_readonly("id", &DecodedTarget::id)
      .def_readonly("quarter_turns", &DecodedTarget::quarter_turns,
                    "Clockwise turns by 90 degrees that bring the cells upright.")
      .def_readonly("corrected", &DecodedTarget::corrected, "Cells that were wrong.")
      .def_readonly("erased", &DecodedTarget::erased, "Cells that were unknown.");

  py::class_<TargetFamily>(module, "TargetFamily",
                           "A family of coded targets: \"matrix5x5\", \"apriltag:36h11\", \"aruco:6x6_250\", …; see "
                           "lumihull/calib/target_family.h.")
      .def(py::init([](const std::string& name) { return TargetFamily::by_name(name); }), "name"_a)
      .def_static("names", &TargetFamily::names, "All families.")
      .def_property_readonly("name", &TargetFamily::name)
      .def_property_readonly(
          "kind", [](const TargetFamily& f) { return f.kind() == TargetKind::circles ? "circles" : "square"; },
          "\"circles\" or \"square\".")
      .def_property_readonly("grid", &TargetFamily::grid, "Cells along a side; squares: with the black border.")
      .def_property_readonly(
          "ids",
          [](const TargetFamily& f) {
            Array<std::int32_t> ids(py::ssize_t(f.ids().size()));
            std::copy(f.ids().begin(), f.ids().end(), ids.mutable_data());
            return ids;
          },
          "The ids that may be printed, ascending.")
      .def_property_readonly("minimum_distance", &TargetFamily::minimum_distance,
                             "Cells in which two ids differ at least, one of them turned by 0 to 3 quarters.")
      .def("has", &TargetFamily::has, "id"_a)
      .def(
          "cells",
          [](const TargetFamily& f, int id) {
            const std::vector<Cell> cells = f.cells(id);
            Array<std::uint8_t> out({py::ssize_t(f.grid()), py::ssize_t(f.grid())});
            std::transform(cells.begin(), cells.end(), out.mutable_data(), [](Cell c) { return std::uint8_t(c); });
            return out;
          },
          "id"_a, "(grid, grid) uint8: 0 = dark, 1 = light.")
      .def(
          "decode",
          [](const TargetFamily& f, const Array<std::uint8_t>& cells, double strength) {
            std::vector<Cell> read;
            for (py::ssize_t i = 0; i < cells.size(); ++i) {
              if (cells.data()[i] > std::uint8_t(Cell::unknown)) invalid("expected cells of 0, 1 or 2", "cells");
              read.push_back(Cell(cells.data()[i]));
            }
            return f.decode(read, strength);
          },
          "cells"_a, "strength"_a = 1.0,
          "Reads (grid, grid) cells, 0 = dark, 1 = light, 2 = unknown, in any rotation; None where no id, or more than "
          "one, is near enough. Circles only.")
      .def(
          "__eq__", [](const TargetFamily& a, const TargetFamily& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const TargetFamily& f) { return std::hash<std::string>()(f.name()); })
      .def("__repr__", [](const TargetFamily& f) { return "TargetFamily('" + f.name() + "')"; });
}

void bind_design(py::module_& module) {
  py::class_<TargetDesign>(
      module, "TargetDesign",
      "One kind of target as printed. Its frame: origin in the middle, x right, y down, z into the "
      "paper, metres.")
      .def(py::init([](const std::string& family, double size_m, double circle_diameter_m, double ring_diameter_m,
                       bool solid_light, double scale_x, double scale_y, std::optional<Rgb> ink,
                       std::optional<Rgb> paper) {
             TargetDesign d;
             d.family = TargetFamily::by_name(family);
             d.size_m = size_m, d.circle_diameter_m = circle_diameter_m, d.ring_diameter_m = ring_diameter_m;
             d.solid_light = solid_light, d.scale_x = scale_x, d.scale_y = scale_y;
             const bool square = d.family.kind() == TargetKind::square;
             d.ink = ink.value_or(square ? Rgb{0, 0, 0} : d.ink);
             d.paper = paper.value_or(square ? Rgb{255, 255, 255} : d.paper);
             return d;
           }),
           "family"_a, "size_m"_a = 0.0, py::kw_only(), "circle_diameter_m"_a = 0.0, "ring_diameter_m"_a = 0.0,
           "solid_light"_a = false, "scale_x"_a = 1.0, "scale_y"_a = 1.0, "ink"_a = py::none(), "paper"_a = py::none(),
           "size_m: circles: pitch; squares: side of the black square; 0: as large as the sheet allows. Circles are "
           "dark "
           "green on light green, squares black on white, where nothing else is said.")
      .def_property_readonly("family", [](const TargetDesign& d) { return d.family; })
      .def_readonly("size_m", &TargetDesign::size_m)
      .def_readonly("circle_diameter_m", &TargetDesign::circle_diameter_m)
      .def_readonly("ring_diameter_m", &TargetDesign::ring_diameter_m)
      .def_readonly("solid_light", &TargetDesign::solid_light)
      .def_readonly("scale_x", &TargetDesign::scale_x)
      .def_readonly("scale_y", &TargetDesign::scale_y)
      .def_property_readonly(
          "ink", [](const TargetDesign& d) { return std::tuple<int, int, int>(d.ink[0], d.ink[1], d.ink[2]); })
      .def_property_readonly(
          "paper", [](const TargetDesign& d) { return std::tuple<int, int, int>(d.paper[0], d.paper[1], d.paper[2]); })
      .def_property_readonly(
          "features",
          [](const TargetDesign& d) { return points_of(d.features(), [&](int i) { return d.feature(i); }); },
          "(n, 2) metres in the target's frame: grid * grid circles, row-major from the top left, or four corners: top "
          "left, top right, bottom right, bottom left.");

  py::class_<PointGrid>(module, "PointGrid",
                        "A field of points for lens calibration: circles, or the inner corners of a chessboard.")
      .def(py::init([](const std::string& kind, int columns, int rows, double spacing_m, double circle_diameter_m) {
             return PointGrid{grid_kind(kind), columns, rows, spacing_m, circle_diameter_m};
           }),
           "kind"_a, "columns"_a, "rows"_a, "spacing_m"_a = 0.0, py::kw_only(), "circle_diameter_m"_a = 0.0,
           "kind: \"circles\" or \"chessboard\". spacing_m 0: as large as the sheet allows.")
      .def_property_readonly("kind", [](const PointGrid& g) { return kind_name(g.kind); })
      .def_readonly("columns", &PointGrid::columns)
      .def_readonly("rows", &PointGrid::rows)
      .def_readonly("spacing_m", &PointGrid::spacing_m)
      .def_readonly("circle_diameter_m", &PointGrid::circle_diameter_m)
      .def_property_readonly(
          "points",
          [](const PointGrid& g) {
            TargetSet set;
            set.grids = {g};
            set.validate();  // sizes of the array
            return points_of(g.columns * g.rows, [&](int i) { return g.point(i); });
          },
          "(rows * columns, 2) metres, row-major.");
}

void bind_set(py::module_& module) {
  py::class_<BoardTarget>(module, "BoardTarget", "A target on a board.")
      .def(py::init([](int design, int id, const std::optional<Pose>& board_from_target) {
             return BoardTarget{design, id, board_from_target.value_or(Pose())};
           }),
           "design"_a, "id"_a, "board_from_target"_a = py::none(), "design: index into the set's designs.")
      .def_readonly("design", &BoardTarget::design)
      .def_readonly("id", &BoardTarget::id)
      .def_property_readonly("board_from_target", [](const BoardTarget& t) { return t.board_from_target; });

  py::class_<Board>(module, "Board", "A rigid body with targets whose places on it are known.")
      .def(py::init([](std::string name, std::vector<BoardTarget> targets) {
             return Board{std::move(name), std::move(targets)};
           }),
           "name"_a, "targets"_a)
      .def_readonly("name", &Board::name)
      .def_property_readonly("targets", [](const Board& b) { return b.targets; });

  py::class_<TargetSet>(module, "TargetSet", "What was printed, and what is known of how it lies.")
      .def(py::init([](std::vector<TargetDesign> designs, std::vector<Board> boards, std::vector<PointGrid> grids) {
             TargetSet set{std::move(designs), std::move(boards), std::move(grids)};
             set.validate();
             return set;
           }),
           "designs"_a = std::vector<TargetDesign>(), "boards"_a = std::vector<Board>(),
           "grids"_a = std::vector<PointGrid>(), "Without boards any id of the designs may be anywhere.")
      .def_static("from_word", &TargetSet::from_word, "word"_a,
                  "\"matrix5x5:18mm\", \"aruco:6x6_250:35mm,chessboard:9x6:25mm\", …")
      .def_static("load", &TargetSet::load, "file"_a, "Reads a \"lumihull-targets\" file.")
      .def_static("from_text", &TargetSet::from_text, "text"_a, "A file where it names one, else a word.")
      .def("save", &TargetSet::save, "file"_a)
      .def_property_readonly("designs", [](const TargetSet& s) { return s.designs; })
      .def_property_readonly("boards", [](const TargetSet& s) { return s.boards; })
      .def_property_readonly("grids", [](const TargetSet& s) { return s.grids; });
}

SheetOptions options_of(const std::string& paper, int per_sheet, bool paint_paper, bool text, bool scale_bar) {
  SheetOptions options;
  if (paper != "letter" && paper != "a4") invalid("expected \"letter\" or \"a4\"", "paper");
  options.paper = paper == "a4" ? Paper::a4 : Paper::letter;
  options.per_sheet = per_sheet;
  options.paint_paper = paint_paper;
  options.ids = text;
  options.scale_bar = scale_bar;
  return options;
}

std::vector<SheetFormat> formats_of(const std::vector<std::string>& names) {
  std::vector<SheetFormat> formats;
  for (const std::string& name : names) {
    if (name != "pdf" && name != "svg") invalid("expected \"pdf\" or \"svg\"", "formats");
    formats.push_back(name == "pdf" ? SheetFormat::pdf : SheetFormat::svg);
  }
  return formats;
}

void bind_sheets(py::module_& module) {
  const std::vector<std::string> pdf{"pdf"};
  module.def(
      "write_target_sheets",
      [](const std::filesystem::path& stem, const TargetDesign& design, const std::vector<int>& ids,
         const std::vector<std::string>& formats, const std::string& paper, int per_sheet, bool paint_paper, bool text,
         bool scale_bar, const py::object& progress) {
        const SheetOptions options = options_of(paper, per_sheet, paint_paper, text, scale_bar);
        const std::vector<SheetFormat> wanted = formats_of(formats);
        return work(progress, 0,
                    [&](Job& job) { return write_target_sheets(stem, design, ids, wanted, options, job); });
      },
      "stem"_a, "design"_a, "ids"_a, py::kw_only(), "formats"_a = pdf, "paper"_a = "letter", "per_sheet"_a = 1,
      "paint_paper"_a = false, "text"_a = true, "scale_bar"_a = true, "progress"_a = py::none(),
      "Draws sheets of targets: STEM.pdf, STEM-1.svg, …, and STEM.json, which says what is on them: returned, too.");
  module.def(
      "write_grid_sheet",
      [](const std::filesystem::path& stem, const PointGrid& grid, const std::vector<std::string>& formats,
         const std::string& paper, bool paint_paper, bool text, bool scale_bar, const Rgb& ink,
         const Rgb& paper_color) {
        const SheetOptions options = options_of(paper, 1, paint_paper, text, scale_bar);
        return write_grid_sheet(stem, grid, formats_of(formats), options, ink, paper_color);
      },
      "stem"_a, "grid"_a, py::kw_only(), "formats"_a = pdf, "paper"_a = "letter", "paint_paper"_a = false,
      "text"_a = true, "scale_bar"_a = true, "ink"_a = Rgb{0, 0, 0}, "paper_color"_a = Rgb{255, 255, 255},
      "Draws one sheet with a field of points for lens calibration.");
}

}  // namespace

void bind_targets(py::module_& module) {
  bind_family(module);
  bind_design(module);
  bind_set(module);
  bind_sheets(module);
}

}  // namespace lumihull::python
