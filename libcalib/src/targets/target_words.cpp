// Target sets from words: "matrix5x5:18mm", "aruco:6x6_250:35mm,chessboard:9x6:25mm".
#include <lumihull/base/error.h>
#include <lumihull/calib/target_set.h>

#include <charconv>
#include <utility>

namespace lumihull::calib {
namespace {

[[noreturn]] void refuse(std::string_view word, const std::string& expected) {
  throw Error(ErrorCode::invalid_argument, "expected " + expected, std::string(word.substr(0, 100)));
}

/// "18mm" in metres.
double length(std::string_view text, std::string_view word) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {{"mm", 1000}, {"cm", 100}, {"m", 1}, {"in", 0}};
  double number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (error == std::errc{} && number > 0)
    for (const auto& [unit, per_metre] : kUnits)
      if (std::string_view(rest, std::size_t(text.data() + text.size() - rest)) == unit)
        return per_metre > 0 ? number / per_metre : number * 0.0254;
  refuse(word, "FAMILY:SIZE with a size in mm, cm, m or in, as \"matrix5x5:18mm\"");
}

int count(std::string_view text, std::string_view word) {
  int number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || rest != text.data() + text.size()) refuse(word, "columns x rows, as \"9x6\"");
  return number;
}

void add(TargetSet& set, std::string_view word) {
  const std::size_t colon = word.rfind(':');
  if (colon == std::string_view::npos) refuse(word, "FAMILY:SIZE, as \"matrix5x5:18mm\"");
  const std::string_view name = word.substr(0, colon);
  const double size = length(word.substr(colon + 1), word);
  const std::size_t kind_end = name.find(':');
  const std::string_view kind = name.substr(0, kind_end);
  if (kind == "chessboard" || kind == "circles") {
    const std::string_view points = kind_end == std::string_view::npos ? "" : name.substr(kind_end + 1);
    const std::size_t cross = points.find('x');
    if (cross == std::string_view::npos) refuse(word, "columns x rows, as \"chessboard:9x6:25mm\"");
    PointGrid grid;
    grid.kind = kind == "circles" ? PointGrid::Kind::circles : PointGrid::Kind::chessboard;
    grid.columns = count(points.substr(0, cross), word);
    grid.rows = count(points.substr(cross + 1), word);
    grid.spacing_m = size;
    set.grids.push_back(grid);
    return;
  }
  TargetDesign design;
  if (name.size() > 100) refuse(word, "a family's name");
  design.family = TargetFamily::by_name(name);
  design.size_m = size;
  if (design.family.kind() == TargetKind::square) {
    design.ink = {0, 0, 0};  // what such targets are printed in, as a rule
    design.paper = {255, 255, 255};
  }
  set.designs.push_back(design);
}

}  // namespace

TargetSet TargetSet::from_word(std::string_view words) {
  TargetSet set;
  if (words.size() > 10'000) refuse(words, "words of at most 10000 bytes");
  for (std::size_t start = 0; start <= words.size();) {
    const std::size_t comma = std::min(words.find(',', start), words.size());
    add(set, words.substr(start, comma - start));
    start = comma + 1;
  }
  try {
    set.validate();
  } catch (const Error& e) {
    throw Error(e.code(), "at " + e.subject() + ": " + e.message(), std::string(words.substr(0, 100)));
  }
  return set;
}

}  // namespace lumihull::calib
