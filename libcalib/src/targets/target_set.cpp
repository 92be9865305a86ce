// What a set of targets may be: contradictions are found here, whoever made the set.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>

#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "target_set_impl.h"

namespace lumihull::calib {
namespace internal {
namespace {

constexpr std::size_t kMostDesigns = 100, kMostBoards = 10'000, kMostTargets = 5'000, kMostGrids = 100;

/// How a target looks, whatever way it is turned: equal for targets that a photograph can't tell apart.
std::vector<Cell> look(const TargetFamily& family, int id) {
  const int n = family.grid();
  std::vector<Cell> turning = family.cells(id), least = turning;
  for (int quarter = 1; quarter < 4; ++quarter) {
    const std::vector<Cell> before = turning;
    for (int row = 0; row < n; ++row)
      for (int column = 0; column < n; ++column)
        turning[std::size_t(column * n + n - 1 - row)] = before[std::size_t(row * n + column)];
    least = std::min(least, turning);
  }
  least.push_back(Cell(family.kind()));
  return least;
}

std::string named(const TargetFamily& family, int id) { return family.name() + " id " + std::to_string(id); }

/// Where any id may be anywhere, no id may belong to two designs.
void check_designs_apart(const TargetSet& set, const Complain& complain) {
  for (std::size_t b = 1; b < set.designs.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const TargetFamily &first = set.designs[a].family, &second = set.designs[b].family;
      if (first.kind() != second.kind() || first.grid() != second.grid()) continue;
      const std::string pointer = "/designs/" + std::to_string(b) + "/family";
      if (first == second)
        complain(pointer, "another family than that of /designs/" + std::to_string(a) +
                              ", or boards that say which id is which");
      std::set<std::vector<Cell>> looks;
      for (const int id : first.ids()) looks.insert(look(first, id));
      for (const int id : second.ids())
        if (looks.contains(look(second, id)))
          complain(pointer, "a family that has no target in common with " + first.name() + " (its id " +
                                std::to_string(id) + " looks like one), or boards that say which id is which");
    }
}

void check_name(const std::string& name, const std::string& pointer, const Complain& complain) {
  if (name.empty() || name.size() > 200) complain(pointer, "a name of 1 to 200 bytes");
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) complain(pointer, "a name without control characters");
}

void check_boards(const TargetSet& set, const Complain& complain) {
  std::map<std::string, std::string> names;        // name -> pointer
  std::map<std::vector<Cell>, std::string> looks;  // look -> pointer
  for (std::size_t b = 0; b < set.boards.size(); ++b) {
    const Board& board = set.boards[b];
    const std::string at = "/boards/" + std::to_string(b);
    check_name(board.name, at + "/name", complain);
    const auto [same, added] = names.emplace(board.name, at);
    if (!added) complain(at + "/name", "a name that " + same->second + " does not have");
    if (board.targets.empty()) complain(at + "/targets", "at least one target");
    if (board.targets.size() > kMostTargets)
      complain(at + "/targets", "at most " + std::to_string(kMostTargets) + " targets");
    for (std::size_t t = 0; t < board.targets.size(); ++t) {
      const BoardTarget& target = board.targets[t];
      const std::string here = at + "/targets/" + std::to_string(t);
      if (target.design < 0 || std::size_t(target.design) >= set.designs.size())
        complain(here + "/design", "an index of /designs, which has " + std::to_string(set.designs.size()));
      const TargetFamily& family = set.designs[std::size_t(target.design)].family;
      if (!family.has(target.id)) complain(here + "/id", "an id of " + family.name());
      const auto [other, fresh] = looks.emplace(look(family, target.id), here);
      if (!fresh)
        complain(here + "/id",
                 "another id: " + named(family, target.id) + " is at " + other->second + " already, or looks like it");
      const Pose& pose = target.board_from_target;
      if (!pose.translation.allFinite() || !(pose.translation.norm() < 1e4))
        complain(here + "/board_from_target/t", "a place within 10 km of the board's origin");
      if (!(std::abs(pose.rotation.norm() - 1) < 1e-6))
        complain(here + "/board_from_target/q", "a quaternion of length 1");
    }
    check_overlaps(set, board, at, complain);
  }
}

/// Grids carry no ids: two of the same look and number of points are one.
void check_grids_apart(const TargetSet& set, const Complain& complain) {
  std::map<std::tuple<PointGrid::Kind, int, int>, std::string> seen;
  for (std::size_t g = 0; g < set.grids.size(); ++g) {
    const PointGrid& grid = set.grids[g];
    const std::string at = "/grids/" + std::to_string(g);
    check_grid(grid, at, complain);
    const auto [same, fresh] =
        seen.emplace(std::tuple(grid.kind, std::min(grid.columns, grid.rows), std::max(grid.columns, grid.rows)), at);
    if (!fresh) complain(at, "another number of points than " + same->second + ", which looks the same");
  }
}

}  // namespace

void check_set(const TargetSet& set, const Complain& complain) {
  if (set.designs.empty() && set.grids.empty()) complain("/designs", "at least one design, or one grid");
  if (set.designs.size() > kMostDesigns) complain("/designs", "at most " + std::to_string(kMostDesigns) + " designs");
  if (set.boards.size() > kMostBoards) complain("/boards", "at most " + std::to_string(kMostBoards) + " boards");
  if (set.grids.size() > kMostGrids) complain("/grids", "at most " + std::to_string(kMostGrids) + " grids");
  for (std::size_t d = 0; d < set.designs.size(); ++d)
    check_design(set.designs[d], "/designs/" + std::to_string(d), complain);
  if (set.boards.empty()) check_designs_apart(set, complain);
  check_boards(set, complain);
  check_grids_apart(set, complain);
}

}  // namespace internal

void TargetSet::validate() const {
  internal::check_set(*this, [](const std::string& pointer, const std::string& expected) {
    throw Error(ErrorCode::invalid_argument, "expected " + expected, pointer);
  });
}

TargetSet TargetSet::load(const std::filesystem::path& file) {
  return internal::parse_target_set(read_file(file, std::size_t(256) << 20), file.string());
}

TargetSet TargetSet::from_text(const std::string& text) {
  std::error_code none;
  if (text.ends_with(".json") || std::filesystem::exists(text, none)) return load(text);
  return from_word(text);
}

void TargetSet::save(const std::filesystem::path& file) const {
  validate();
  write_file(file, internal::print_target_set(*this, file.string()));
}

}  // namespace lumihull::calib
