#include <lumihull/base/error.h>

#include <algorithm>
#include <bit>
#include <map>
#include <mutex>
#include <numeric>

#include "matrix_codes.h"
#include "target_family_impl.h"

namespace lumihull::calib {
namespace {

constexpr std::string_view kApriltag = "apriltag:", kAruco = "aruco:";

/// The left column and the bottom row.
CellBits dark_l(int grid) {
  CellBits l = 0;
  for (int i = 0; i < grid; ++i) l |= CellBits(1) << (i * grid) | CellBits(1) << ((grid - 1) * grid + i);
  return l;
}

/// Which data cell, counted row-major, holds bit i of the code's word, and which bits are inverted.
///
/// Any order and any inversion keep the distances between upright words; between turned ones they decide. These were
/// searched for (steepest descent from random orders) such that (a) words keep their distance when one of them is
/// turned: matrix5x5 4 cells, matrix6x6 6, for all words, where row-major order without inversion lets 4 and 2 of them
/// look alike; (b) a grid of dark discs alone is 4 cells or more from every word, so that a field of points for lens
/// calibration is never read as a target. The tests prove both by going through all words.
struct Layout {
  std::vector<int> cell;
  std::uint32_t inverted = 0;
};
const Layout& layout_of_16() {
  static const Layout layout{{0, 10, 15, 12, 11, 5, 9, 14, 1, 13, 7, 4, 3, 8, 2, 6}, 0x3978};
  return layout;
}
const Layout& layout_of_24() {
  static const Layout layout{{3, 17, 5, 4, 18, 0, 22, 6, 16, 14, 8, 20, 2, 19, 23, 1, 21, 11, 12, 7, 13, 9, 10, 15},
                             0x7a20c6};
  return layout;
}

/// Words as grids: bit i of a word stands in the data cell that the layout names. light: a cell that is always light.
std::vector<CellBits> placed(std::span<const std::uint32_t> words, int grid, const Layout& layout, CellBits light = 0) {
  std::vector<int> data;
  for (int i = 0; i < grid * grid; ++i)
    if (!((dark_l(grid) | light) >> i & 1)) data.push_back(i);
  std::vector<CellBits> grids;
  for (std::uint32_t word : words) {
    word ^= layout.inverted;
    CellBits cells = light;
    for (std::size_t i = 0; i < layout.cell.size(); ++i)
      cells |= CellBits(word >> i & 1) << data[std::size_t(layout.cell[i])];
    grids.push_back(cells);
  }
  return grids;
}

/// Least number of cells in which two of the words differ, one of them turned by 0 … 3 quarters.
int least_distance(std::span<const CellBits> words, int side) {
  int least = side * side;
  for (std::size_t i = 0; i < words.size(); ++i) {
    CellBits turning = words[i];
    for (int quarter = 0; quarter < 4; ++quarter, turning = turned(turning, side))
      // A pair is met once in each relative turn: j turned by -q against i is i turned by q against j.
      for (std::size_t j = quarter == 0 ? i + 1 : i; j < words.size(); ++j)
        least = std::min(least, std::popcount(turning ^ words[j]));
  }
  return least;
}

/// The words of a family, by id, for its ids 0, 1, ….
struct FamilyWords {
  TargetKind kind = TargetKind::circles;
  int grid = 0, side = 0;
  int distance = 0;  ///< circle families
  std::vector<CellBits> words;
};

std::optional<FamilyWords> circle_words(std::string_view name) {
  if (name == "paper4x4") {
    std::vector<std::uint32_t> values(512);
    std::iota(values.begin(), values.end(), 0u);
    Layout row_major{std::vector<int>(9)};
    std::iota(row_major.cell.begin(), row_major.cell.end(), 0);
    return FamilyWords{TargetKind::circles, 4, 4, 1, placed(values, 4, row_major)};
  }
  if (name == "matrix5x5")
    return FamilyWords{TargetKind::circles, 5, 5, 6, placed(nordstrom_robinson_words(), 5, layout_of_16())};
  if (name == "matrix6x6")
    return FamilyWords{TargetKind::circles, 6, 6, 8, placed(golay_words(), 6, layout_of_24(), CellBits(1) << 5)};
  return std::nullopt;
}

std::optional<FamilyWords> square_words(std::string_view name) {
  std::optional<SquareWords> square;
  if (name.starts_with(kApriltag)) square = apriltag_words(name.substr(kApriltag.size()));
  if (name.starts_with(kAruco)) square = aruco_words(name.substr(kAruco.size()));
  if (!square) return std::nullopt;
  return FamilyWords{TargetKind::square, square->side + 2, square->side, 0, std::move(square->words)};
}

/// Which words look like no word, not even like themselves, when they are turned.
std::vector<int> unmistakable(std::span<const CellBits> words, int side) {
  std::vector<CellBits> sorted(words.begin(), words.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> ids;
  for (std::size_t i = 0; i < words.size(); ++i) {
    bool mistakable = false;
    CellBits turning = words[i];
    for (int quarter = 1; quarter < 4; ++quarter) {
      turning = turned(turning, side);
      mistakable |= std::binary_search(sorted.begin(), sorted.end(), turning);
    }
    if (!mistakable) ids.push_back(int(i));
  }
  return ids;
}

std::string all_names() {
  std::string text;
  for (const std::string& name : TargetFamily::names()) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

CellBits turned(CellBits cells, int side) noexcept {
  CellBits out = 0;
  for (; cells; cells &= cells - 1) {
    const int i = std::countr_zero(cells), row = i / side, column = i % side;
    out |= CellBits(1) << (column * side + side - 1 - row);
  }
  return out;
}

std::shared_ptr<const TargetFamily::Impl> TargetFamily::Impl::make(std::string_view name) {
  std::optional<FamilyWords> family = circle_words(name);
  if (!family) family = square_words(name);
  if (!family)
    throw Error(ErrorCode::invalid_argument, "no such family of targets; there are " + all_names(), std::string(name));
  const auto impl = std::make_shared<Impl>();
  impl->name = name;
  impl->kind = family->kind;
  impl->grid = family->grid;
  impl->side = family->side;
  impl->distance = family->distance;
  impl->ids = unmistakable(family->words, family->side);
  for (const int id : impl->ids) impl->words.push_back(family->words[std::size_t(id)]);
  return impl;
}

int TargetFamily::Impl::index(int id) const {
  const auto it = std::lower_bound(ids.begin(), ids.end(), id);
  return it != ids.end() && *it == id ? int(it - ids.begin()) : -1;
}

TargetFamily TargetFamily::by_name(std::string_view name) {
  // Families are made once a process: a design's default value asks for one.
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<const Impl>, std::less<>> made;
  const std::lock_guard lock(mutex);
  auto it = made.find(name);
  if (it == made.end()) it = made.emplace(std::string(name), Impl::make(name)).first;
  return TargetFamily(it->second);
}

std::vector<std::string> TargetFamily::names() {
  std::vector<std::string> names{"paper4x4", "matrix5x5", "matrix6x6"};
  for (const std::string& name : apriltag_names()) names.push_back(std::string(kApriltag) + name);
  for (const std::string& name : aruco_names()) names.push_back(std::string(kAruco) + name);
  return names;
}

const std::string& TargetFamily::name() const noexcept { return impl_->name; }
TargetKind TargetFamily::kind() const noexcept { return impl_->kind; }
int TargetFamily::grid() const noexcept { return impl_->grid; }
std::span<const int> TargetFamily::ids() const noexcept { return impl_->ids; }
bool TargetFamily::has(int id) const noexcept { return impl_->index(id) >= 0; }

int TargetFamily::minimum_distance() const noexcept {
  std::call_once(impl_->distance_once, [this] { impl_->rotated_distance = least_distance(impl_->words, impl_->side); });
  return impl_->rotated_distance;
}

std::vector<Cell> TargetFamily::cells(int id) const {
  const int index = impl_->index(id);
  if (index < 0) throw Error(ErrorCode::invalid_argument, "the family has no id " + std::to_string(id), impl_->name);
  const CellBits word = impl_->words[std::size_t(index)];
  const int frame = (impl_->grid - impl_->side) / 2;
  std::vector<Cell> cells(std::size_t(impl_->grid * impl_->grid), Cell::dark);
  for (int i = 0; i < impl_->side * impl_->side; ++i)
    if (word >> i & 1)
      cells[std::size_t((i / impl_->side + frame) * impl_->grid + i % impl_->side + frame)] = Cell::light;
  return cells;
}

std::optional<DecodedTarget> TargetFamily::decode(std::span<const Cell> cells, double strength) const {
  if (impl_->kind != TargetKind::circles)
    throw Error(ErrorCode::invalid_argument, "only circle families are decoded from cells", impl_->name);
  if (cells.size() != std::size_t(impl_->grid * impl_->grid))
    throw Error(ErrorCode::invalid_argument, "expected grid x grid cells", impl_->name);
  if (!(strength >= 0 && strength <= 1))
    throw Error(ErrorCode::invalid_argument, "expected a strength from 0 to 1", impl_->name);

  CellBits light = 0, known = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    light |= CellBits(cells[i] == Cell::light) << i;
    known |= CellBits(cells[i] != Cell::unknown) << i;
  }
  const int erased = int(cells.size()) - std::popcount(known);
  if (erased >= impl_->distance) return std::nullopt;
  const int at_most = int(strength * ((impl_->distance - 1 - erased) / 2));

  const CellBits l = dark_l(impl_->grid);
  std::optional<DecodedTarget> found;
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (quarter > 0) {
      light = turned(light, impl_->side);
      known = turned(known, impl_->side);
    }
    if (std::popcount(light & l) > at_most) continue;  // the L is dark in every word
    for (std::size_t i = 0; i < impl_->words.size(); ++i) {
      const int wrong = std::popcount((impl_->words[i] ^ light) & known);
      if (wrong > at_most) continue;
      if (found) return std::nullopt;
      found = DecodedTarget{impl_->ids[i], quarter, wrong, erased};
    }
  }
  return found;
}

}  // namespace lumihull::calib
