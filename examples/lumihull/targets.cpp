// lumihull targets -o STEM: sheets of targets to print.

#include <lumihull/base/error.h>
#include <lumihull/calib/target_sheet.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>

#include "program.h"

namespace lumihull::program {

namespace {

using namespace lumihull::calib;

struct Arguments {
  std::string output, family = "matrix5x5", ids, board, size, circle, ring, bar, ink, paper_color;
  std::string paper = "letter", format = "pdf";
  int per_sheet = 1;
  bool solid_light = false, paint_paper = false, no_text = false, no_bar = false, overwrite = false, list = false;
};

constexpr std::size_t kDefaultIds = 12;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    parts.push_back(text.substr(start, comma - start));
    start = comma + 1;
  }
  return parts;
}

int whole_number(const std::string& text, const char* flag, const char* expected) {
  int value = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || rest != text.data() + text.size() || value < 0)
    throw Error(ErrorCode::invalid_argument, expected, flag);
  return value;
}

/// "0-59,100": of a range those ids that the family has. "all", and nothing for the first few.
std::vector<int> parse_ids(const std::string& text, const TargetFamily& family) {
  const std::vector<int> all(family.ids().begin(), family.ids().end());
  if (text == "all") return all;
  if (text.empty()) return {all.begin(), all.begin() + std::ptrdiff_t(std::min(kDefaultIds, all.size()))};
  constexpr const char* kExpected = "expected ids and ranges of ids as 0-59,100, or all";
  std::vector<int> ids;
  for (const std::string& part : split(text)) {
    const std::size_t dash = part.find('-');
    if (dash == std::string::npos) {
      ids.push_back(whole_number(part, "--ids", kExpected));
      continue;
    }
    const int first = whole_number(part.substr(0, dash), "--ids", kExpected);
    const int last = whole_number(part.substr(dash + 1), "--ids", kExpected);
    const auto begin = std::lower_bound(all.begin(), all.end(), first),
               end = std::upper_bound(all.begin(), all.end(), last);
    if (begin >= end)
      throw Error(ErrorCode::invalid_argument,
                  family.name() + " has no ids " + part + "; it has " + std::to_string(all.front()) + " to " +
                      std::to_string(all.back()),
                  "--ids");
    ids.insert(ids.end(), begin, end);
  }
  return ids;
}

/// "r,g,b" or "#rrggbb".
Rgb parse_color(const std::string& text, const char* flag) {
  constexpr const char* kExpected = "expected a colour as r,g,b from 0 to 255, or #rrggbb";
  Rgb color{};
  if (text.size() == 7 && text[0] == '#') {
    for (std::size_t c = 0; c < 3; ++c) {
      const char* begin = text.data() + 1 + 2 * c;
      const auto [rest, error] = std::from_chars(begin, begin + 2, color[c], 16);
      if (error != std::errc{} || rest != begin + 2) throw Error(ErrorCode::invalid_argument, kExpected, flag);
    }
    return color;
  }
  const std::vector<std::string> parts = split(text);
  if (parts.size() != 3) throw Error(ErrorCode::invalid_argument, kExpected, flag);
  for (std::size_t c = 0; c < 3; ++c) {
    const int value = whole_number(parts[c], flag, kExpected);
    if (value > 255) throw Error(ErrorCode::invalid_argument, kExpected, flag);
    color[c] = std::uint8_t(value);
  }
  return color;
}

/// "18mm" in metres, by the rules for words.
double parse_length(const std::string& text, const char* flag) {
  try {
    return TargetSet::from_word("matrix5x5:" + text).designs[0].size_m;
  } catch (const Error&) {
    throw Error(ErrorCode::invalid_argument, "expected a length in mm, cm, m or in, as 18mm", flag);
  }
}

/// How many times too large the printer prints.
double scale_of(const Arguments& a) { return a.bar.empty() ? 1 : parse_length(a.bar, "--bar") / 0.15; }

TargetDesign design_of(const Arguments& a) {
  TargetDesign design;
  design.family = TargetFamily::by_name(a.family);
  design.size_m = a.size.empty() ? 0 : parse_length(a.size, "--size");
  if (!a.circle.empty()) design.circle_diameter_m = parse_length(a.circle, "--circle");
  if (!a.ring.empty()) design.ring_diameter_m = parse_length(a.ring, "--ring");
  design.solid_light = a.solid_light;
  design.scale_x = design.scale_y = scale_of(a);
  if (design.family.kind() == TargetKind::square) {
    design.ink = {0, 0, 0};
    design.paper = {255, 255, 255};
  }
  if (!a.ink.empty()) design.ink = parse_color(a.ink, "--ink");
  if (!a.paper_color.empty()) design.paper = parse_color(a.paper_color, "--paper-color");
  return design;
}

/// "chessboard:9x6:25mm", or without the size: as large as fits.
PointGrid parse_board(const Arguments& a) {
  const bool sized = std::count(a.board.begin(), a.board.end(), ':') >= 2;
  if ((!a.board.starts_with("chessboard:") && !a.board.starts_with("circles:")) ||
      a.board.find(',') != std::string::npos)
    throw Error(ErrorCode::invalid_argument, "expected chessboard:9x6:25mm or circles:11x8:15mm", "--board");
  const TargetSet set = TargetSet::from_word(sized ? a.board : a.board + ":1mm");
  PointGrid grid = set.grids[0];
  if (!sized) grid.spacing_m = 0;
  if (!a.circle.empty()) grid.circle_diameter_m = parse_length(a.circle, "--circle");
  return grid;
}

std::vector<SheetFormat> parse_formats(const std::string& text) {
  std::vector<SheetFormat> formats;
  for (const std::string& part : split(text)) {
    if (part != "pdf" && part != "svg")
      throw Error(ErrorCode::invalid_argument, "expected pdf, svg or pdf,svg", "--format");
    formats.push_back(part == "pdf" ? SheetFormat::pdf : SheetFormat::svg);
  }
  return formats;
}

/// What will be written.
std::vector<std::string> files_of(const std::string& stem, const std::vector<SheetFormat>& formats,
                                  std::size_t sheets) {
  std::vector<std::string> files;
  if (std::find(formats.begin(), formats.end(), SheetFormat::pdf) != formats.end()) files.push_back(stem + ".pdf");
  if (std::find(formats.begin(), formats.end(), SheetFormat::svg) != formats.end())
    for (std::size_t i = 1; i <= sheets; ++i) files.push_back(stem + "-" + std::to_string(i) + ".svg");
  files.push_back(stem + ".json");
  return files;
}

std::string millimetres(double length_m) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g mm", 1e3 * length_m);
  return text;
}

void say_families(Program& program) {
  std::string json;
  for (const std::string& name : TargetFamily::names()) {
    const TargetFamily family = TargetFamily::by_name(name);
    const std::span<const int> ids = family.ids();
    program.say(name + std::string(name.size() < 16 ? 16 - name.size() : 1, ' ') + std::to_string(ids.size()) +
                " ids, " + std::to_string(ids.front()) + " to " + std::to_string(ids.back()));
    json += (json.empty() ? "" : ", ") + json_text(name) + ": " + std::to_string(ids.size());
  }
  if (program.json) std::cout << "{\"families\": {" << json << "}}\n";
}

/// What came of a run.
struct Written {
  std::vector<std::string> files;  ///< the last one: what is on the sheets
  std::size_t sheets = 0;
  double size_m = 0;  ///< true length
  std::string what;   ///< for people, but for the size
  std::string word;   ///< for --targets, but for the size
};

void refuse_existing(const Arguments& a, const std::vector<std::string>& files) {
  if (a.overwrite) return;
  for (const std::string& file : files)
    if (std::filesystem::exists(file))
      throw Error(ErrorCode::invalid_argument, "the file exists; name another one, or --overwrite", file);
}

Written write_targets(Program& program, const Arguments& a, const std::string& stem, const SheetOptions& options) {
  const std::vector<SheetFormat> formats = parse_formats(a.format);
  const TargetDesign design = design_of(a);
  const std::vector<int> ids = parse_ids(a.ids, design.family);
  const std::size_t per_sheet = std::size_t(options.per_sheet);
  Written written;
  written.sheets = (ids.size() + per_sheet - 1) / per_sheet;
  written.files = files_of(stem, formats, written.sheets);
  refuse_existing(a, written.files);
  const TargetSet set = write_target_sheets(stem, design, ids, formats, options, program.job());
  written.size_m = set.designs[0].size_m * design.scale_x;
  written.what = std::to_string(ids.size()) + " targets of " + a.family +
                 (design.family.kind() == TargetKind::circles ? ", pitch " : ", black square ");
  written.word = a.family;
  return written;
}

Written write_board(const Arguments& a, const std::string& stem, const SheetOptions& options) {
  const std::vector<SheetFormat> formats = parse_formats(a.format);
  const Rgb ink = a.ink.empty() ? Rgb{0, 0, 0} : parse_color(a.ink, "--ink");
  const Rgb paper = a.paper_color.empty() ? Rgb{255, 255, 255} : parse_color(a.paper_color, "--paper-color");
  Written written;
  written.sheets = 1;
  written.files = files_of(stem, formats, 1);
  refuse_existing(a, written.files);
  TargetSet set = write_grid_sheet(stem, parse_board(a), formats, options, ink, paper);
  PointGrid& grid = set.grids[0];
  if (!a.bar.empty()) {
    grid.spacing_m *= scale_of(a);
    grid.circle_diameter_m *= scale_of(a);
    set.save(written.files.back());
  }
  written.size_m = grid.spacing_m;
  written.word = (grid.kind == PointGrid::Kind::circles ? "circles:" : "chessboard:") + std::to_string(grid.columns) +
                 "x" + std::to_string(grid.rows);
  written.what = written.word + ", spacing ";
  return written;
}

void write_sheets(Program& program, const Arguments& a) {
  std::string stem = a.output;
  for (const char* ending : {".pdf", ".svg", ".json"})
    if (stem.ends_with(ending)) stem.resize(stem.size() - std::string(ending).size());
  if (stem.empty())
    throw Error(ErrorCode::invalid_argument, "expected a name for the files, as -o targets", "--output");
  const SheetOptions options{.paper = a.paper == "a4" ? Paper::a4 : Paper::letter,
                             .per_sheet = a.per_sheet,
                             .paint_paper = a.paint_paper,
                             .ids = !a.no_text,
                             .scale_bar = !a.no_bar};
  Written w = a.board.empty() ? write_targets(program, a, stem, options) : write_board(a, stem, options);
  const std::string size = millimetres(w.size_m);
  w.word += ":" + size.substr(0, size.find(' ')) + "mm";

  program.say(w.files.front() + (w.files.size() > 2 ? " and others" : "") + ": " + std::to_string(w.sheets) +
              (w.sheets == 1 ? " sheet, " : " sheets, ") + w.what + size);
  program.say(w.files.back() + ": what is on them" +
              (a.per_sheet == 1 ? "" : "; once a sheet is cut apart, use the word " + w.word + " in its place"));
  program.say("Print at 100 % (\"actual size\", not \"fit to page\").");
  if (options.scale_bar && a.bar.empty())
    program.say(
        "Then measure the bar. Where it is not 150.0 mm long, say so: the same command with --overwrite --bar 149.2mm");
  if (!program.json) return;
  std::string list;
  for (const std::string& file : w.files) list += (list.empty() ? "" : ", ") + json_text(file);
  char number[40];
  std::snprintf(number, sizeof number, "%.9g", w.size_m);
  std::cout << "{\"files\": [" << list << "], \"targets\": " << json_text(w.files.back())
            << ", \"word\": " << json_text(w.word) << ", \"sheets\": " << w.sheets << ", \"size_m\": " << number
            << "}\n";
}

}  // namespace

void add_targets(Program& program) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* verb =
      program.verb("targets", "sheets of targets to print: PDF or SVG, and a file that says what is on them",
                   [&program, a] { a->list ? say_families(program) : write_sheets(program, *a); });
  verb->add_option("-o,--output", a->output, "names the files: NAME.pdf, NAME-1.svg …, NAME.json");
  verb->add_option("--family", a->family,
                   "matrix5x5: 256 targets; matrix6x6: 4096; paper4x4: the paper's; apriltag:36h11, aruco:6x6_250, …: "
                   "--list shows all [matrix5x5]");
  verb->add_option("--ids", a->ids, "which of the family, as 0-59,100; or all [the first 12]");
  verb->add_option(
      "--board", a->board,
      "a field of points for lens calibration instead: chessboard:9x6:25mm (inner corners, side of a square) "
      "or circles:11x8:15mm (points, spacing); without the length as large as fits");
  verb->add_option("--paper", a->paper, "letter or a4 [letter]")->check(CLI::IsMember({"letter", "a4"}));
  verb->add_option("--per-sheet", a->per_sheet, "targets on a sheet, 1 or 4 [1]")->check(CLI::IsMember({1, 4}));
  verb->add_option("--size", a->size,
                   "circles: from one centre to the next; squares: side of the black square; 18mm, 1.8cm, 0.7in "
                   "[as large as fits]");
  verb->add_option("--circle", a->circle, "a circle's diameter [half of the spacing]");
  verb->add_option("--ring", a->ring, "diameter of the light centre of a ring [0.55 of the circle's]");
  verb->add_flag("--solid-light", a->solid_light, "light circles without a ring, white on painted paper");
  verb->add_option("--ink", a->ink, "colour as r,g,b or #rrggbb [0,70,30, dark green; squares and boards: black]");
  verb->add_option("--paper-color", a->paper_color,
                   "the paper's [150,205,150, light green; squares and boards: white]");
  verb->add_flag("--paint-paper", a->paint_paper,
                 "let the printer colour white paper; without it put coloured paper in");
  verb->add_option("--format", a->format, "pdf, svg or pdf,svg [pdf]");
  verb->add_flag("--no-text", a->no_text, "no ids and no description in plain text");
  verb->add_flag("--no-bar", a->no_bar, "no bar of 150.0 mm");
  verb->add_option("--bar", a->bar,
                   "how long the bar is on paper, where it is not 150.0mm: the file then says the true lengths");
  verb->add_flag("--overwrite", a->overwrite, "replace files that exist");
  verb->add_flag("--list", a->list, "the families and how many ids each has; writes nothing");
  verb->footer(
      "Print at 100 % (\"actual size\", not \"fit to page\"), then measure the bar on the sheet: it must be 150.0 mm "
      "long.\n"
      "Fix the sheets flat. Each target has its number below it; no number may be used twice around an object.\n"
      "Example: lumihull targets --ids 0-23 --per-sheet 4 --paper a4 --paint-paper -o targets");
}

}  // namespace lumihull::program
