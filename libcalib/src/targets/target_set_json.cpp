// Target sets on disk: "lumihull-targets", version 1. Fields are called as in the structs.
#include <lumihull/internal/json.h>
#include <lumihull/internal/pose_json.h>

#include <initializer_list>

#include "target_set_impl.h"
#include "target_set_json.h"

namespace lumihull::calib::internal {
namespace {

using lumihull::internal::Json;
using lumihull::internal::JsonReader;
using lumihull::internal::print_pose;
using lumihull::internal::read_pose;

constexpr const char* kFormat = "lumihull-targets";
constexpr std::int64_t kVersion = 1;
constexpr std::size_t kMostEntries = 100'000;  // check_set has the lower limits; this one is for memory

/// A field misspelt would pass as one left out.
void know_fields(const JsonReader& json, std::initializer_list<std::string_view> known) {
  if (!json.value().is_object()) json.fail("an object");
  for (const auto& item : json.value().items()) {
    if (std::find(known.begin(), known.end(), item.key()) != known.end()) continue;
    std::string fields;
    for (const std::string_view field : known) fields += (fields.empty() ? "" : ", ") + std::string(field);
    json.fail("no field \"" + item.key().substr(0, 60) + "\"; there are " + fields);
  }
}

Rgb read_color(const JsonReader& json) {
  if (json.array_size(3) != 3) json.fail("three integers from 0 to 255");
  Rgb color;
  for (std::size_t c = 0; c < 3; ++c) color[c] = std::uint8_t(json.at(c).integer(0, 255));
  return color;
}

TargetDesign read_design(const JsonReader& json) {
  know_fields(json, {"family", "size_m", "circle_diameter_m", "ring_diameter_m", "solid_light", "scale_x", "scale_y",
                     "ink", "paper"});
  TargetDesign design;
  const std::string family = json.at("family").string(100);
  try {
    design.family = TargetFamily::by_name(family);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::invalid_argument && e.code() != ErrorCode::unsupported) throw;
    json.at("family").fail("a family of targets: \"" + family + "\": " + e.message());
  }
  design.size_m = json.at("size_m").positive();
  const std::pair<const char*, double*> sizes[] = {{"circle_diameter_m", &design.circle_diameter_m},
                                                   {"ring_diameter_m", &design.ring_diameter_m},
                                                   {"scale_x", &design.scale_x},
                                                   {"scale_y", &design.scale_y}};
  for (const auto& [field, value] : sizes)
    if (json.has(field)) *value = json.at(field).number();
  if (json.has("solid_light")) design.solid_light = json.at("solid_light").boolean();
  if (json.has("ink")) design.ink = read_color(json.at("ink"));
  if (json.has("paper")) design.paper = read_color(json.at("paper"));
  return design;
}

Json print_design(const TargetDesign& design) {
  Json json{{"family", design.family.name()}, {"size_m", design.size_m}};
  if (design.circle_diameter_m != 0) json["circle_diameter_m"] = design.circle_diameter_m;
  if (design.ring_diameter_m != 0) json["ring_diameter_m"] = design.ring_diameter_m;
  if (design.solid_light) json["solid_light"] = true;
  if (design.scale_x != 1) json["scale_x"] = design.scale_x;
  if (design.scale_y != 1) json["scale_y"] = design.scale_y;
  json["ink"] = design.ink;
  json["paper"] = design.paper;
  return json;
}

Board read_board(const JsonReader& json) {
  know_fields(json, {"name", "targets"});
  Board board;
  board.name = json.at("name").string();
  const JsonReader targets = json.at("targets");
  const std::size_t n = targets.array_size(kMostEntries);
  for (std::size_t i = 0; i < n; ++i) {
    const JsonReader target = targets.at(i);
    know_fields(target, {"design", "id", "board_from_target"});
    const JsonReader place = target.at("board_from_target");
    know_fields(place, {"q", "t"});
    board.targets.push_back(
        {int(target.at("design").integer(0, INT32_MAX)), int(target.at("id").integer(0, INT32_MAX)), read_pose(place)});
  }
  return board;
}

Json print_board(const Board& board) {
  Json targets = Json::array();
  for (const BoardTarget& target : board.targets)
    targets.push_back(
        {{"design", target.design}, {"id", target.id}, {"board_from_target", print_pose(target.board_from_target)}});
  return {{"name", board.name}, {"targets", std::move(targets)}};
}

PointGrid read_grid(const JsonReader& json) {
  know_fields(json, {"kind", "columns", "rows", "spacing_m", "circle_diameter_m"});
  PointGrid grid;
  const std::string kind = json.at("kind").string();
  if (kind != "circles" && kind != "chessboard") json.at("kind").fail("\"circles\" or \"chessboard\"");
  grid.kind = kind == "circles" ? PointGrid::Kind::circles : PointGrid::Kind::chessboard;
  grid.columns = int(json.at("columns").integer(2, 100));
  grid.rows = int(json.at("rows").integer(2, 100));
  grid.spacing_m = json.at("spacing_m").positive();
  if (json.has("circle_diameter_m")) grid.circle_diameter_m = json.at("circle_diameter_m").number();
  return grid;
}

Json print_grid(const PointGrid& grid) {
  Json json{{"kind", grid.kind == PointGrid::Kind::circles ? "circles" : "chessboard"},
            {"columns", grid.columns},
            {"rows", grid.rows},
            {"spacing_m", grid.spacing_m}};
  if (grid.circle_diameter_m != 0) json["circle_diameter_m"] = grid.circle_diameter_m;
  return json;
}

/// The entries of an optional list.
template <class Read>
auto read_list(const JsonReader& top, std::string_view field, Read read) {
  std::vector<decltype(read(top))> list;
  if (!top.has(field)) return list;
  const JsonReader json = top.at(field);
  const std::size_t n = json.array_size(kMostEntries);
  for (std::size_t i = 0; i < n; ++i) list.push_back(read(json.at(i)));
  return list;
}

template <class Item, class Print>
Json print_list(const std::vector<Item>& items, Print print) {
  Json list = Json::array();
  for (const Item& item : items) list.push_back(print(item));
  return list;
}

}  // namespace

TargetSet read_target_set(const JsonReader& top) {
  lumihull::internal::check_format(top, kFormat, kVersion);
  know_fields(top, {"format", "version", "designs", "boards", "grids"});
  TargetSet set;
  set.designs = read_list(top, "designs", read_design);
  set.boards = read_list(top, "boards", read_board);
  set.grids = read_list(top, "grids", read_grid);
  check_set(set, [&](const std::string& pointer, const std::string& expected) {
    throw Error(ErrorCode::bad_input, "at " + top.pointer() + pointer + ": expected " + expected, top.file());
  });
  return set;
}

Json json_of(const TargetSet& set) {
  Json json{{"format", kFormat}, {"version", kVersion}};
  if (!set.designs.empty()) json["designs"] = print_list(set.designs, print_design);
  if (!set.boards.empty()) json["boards"] = print_list(set.boards, print_board);
  if (!set.grids.empty()) json["grids"] = print_list(set.grids, print_grid);
  return json;
}

TargetSet parse_target_set(std::string_view text, const std::string& name) {
  const Json document = lumihull::internal::parse_json(text, name);
  return read_target_set(JsonReader(document, name));
}

std::string print_target_set(const TargetSet& set, const std::string& name) {
  return lumihull::internal::print_json(json_of(set), name);
}

}  // namespace lumihull::calib::internal
