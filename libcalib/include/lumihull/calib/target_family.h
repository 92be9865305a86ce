#pragma once

#include <lumihull/base/api.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::calib {

/// What is measured on a target: the centres of circles, or the four corners of a square.
enum class TargetKind : std::uint8_t { circles, square };

/// What was read in one cell of a target's grid. `unknown` is an erasure: hidden, blurred, or between the two.
enum class Cell : std::uint8_t { dark, light, unknown };

/// An id that was read.
struct DecodedTarget {
  int id = 0;
  /// How often the grid that was read has to be turned by 90°, clockwise as seen in the grid, to stand upright.
  int quarter_turns = 0;
  int corrected = 0;  ///< cells that were read wrongly
  int erased = 0;     ///< cells that were unknown
};

/// A family of coded targets: how an id becomes a grid of dark and light cells, and back.
///
/// Circle families (paper, fig. 5, and its successors): a grid x grid arrangement of circles of one outer diameter.
/// dark: a disc; light: a ring, so that every outer contour can be measured whatever the id. The left column and the
/// bottom row are dark: an L that gives the orientation. The other cells hold the id.
///
/// | family    | cells of the id              | ids  | distance | turned | corrects |
/// |-----------|------------------------------|------|----------|--------|----------|
/// | paper4x4  | 9, row-major: id = Σ 2^i b_i |  400 | 1        | 1      | 0        |
/// | matrix5x5 | 16, Nordstrom-Robinson code  |  256 | 6        | 4      | 2        |
/// | matrix6x6 | 24, extended Golay code      | 4096 | 8        | 6      | 3        |
///
/// (Nordstrom & Robinson 1967; Golay 1949.) Distance: in how many of all grid x grid cells, those of the L included,
/// two ids differ at least; turned: one of them turned by 0 to 3 quarters, and an id turned by 1 to 3 quarters against
/// itself, too. paper4x4 has 512 values, of which 112 show a second dark L when turned and are left out. In matrix6x6
/// the cell opposite of the L's corner is always light. The matrix codes' bits are ordered and inverted such that all
/// words keep those distances, and that a field of dark circles alone is 4 cells (matrix6x6: 5) from every word.
///
/// Square families are those of AprilTag ("apriltag:36h11", …) and ArUco ("aruco:6x6_250", …); their grids include the
/// black border, not the white one around it.
///
/// An immutable value; copies share their tables.
class LUMIHULL_API TargetFamily {
 public:
  /// Error{invalid_argument} naming what families there are.
  static TargetFamily by_name(std::string_view name);
  /// All names that `by_name` knows, circle families first.
  static std::vector<std::string> names();

  const std::string& name() const noexcept;
  TargetKind kind() const noexcept;
  int grid() const noexcept;  ///< cells along a side

  /// The ids that may be printed, ascending: those that can't be taken for another one when turned.
  std::span<const int> ids() const noexcept;
  bool has(int id) const noexcept;
  /// Least number of cells in which two of ids() differ, one of them turned by 0 to 3 quarters, or one of them from
  /// itself turned by 1 to 3. Counted at the first call (up to 0.1 s).
  int minimum_distance() const noexcept;

  /// The cells of an id, grid x grid, row-major from the top left. Error{invalid_argument} where !has(id).
  std::vector<Cell> cells(int id) const;

  /// Reads grid x grid cells in any rotation. nullopt where no id in no rotation, or more than one, is within the
  /// family's power, 2 · wrong + erased < distance (the L's cells count like others). So it is never wrong while the
  /// truth is within that power; what is as near to another id is refused (two wrong cells of matrix5x5: one in eight;
  /// three of matrix6x6: one in 250). Beyond that power wrong ids are read: of matrix5x5 with four wrong cells one in
  /// six, from random cells one in a hundred, or one in a thousand at half the strength.
  /// `strength` (0 … 1) lowers how many wrong cells are corrected: 0 accepts none. About 10 µs.
  /// Error{invalid_argument}: another number of cells, a square family, strength out of range.
  std::optional<DecodedTarget> decode(std::span<const Cell> cells, double strength = 1) const;

  bool operator==(const TargetFamily& other) const noexcept { return name() == other.name(); }

 private:
  struct Impl;
  explicit TargetFamily(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace lumihull::calib
