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
/// Circle families (paper, fig. 5, and its successors): a grid x grid arrangement of circles of one outer diameter. dark:
/// a disc; light: a ring, so that every outer contour can be measured whatever the id. The left column and the bottom row
/// are dark: an L that gives the orientation. The other cells hold the id; bits in row-major order from the top left.
///
/// - "paper4x4": 9 cells, value = Σ 2^i b_i; no check. 400 of the 512 values have no second dark L.
/// - "matrix5x5": 16 cells, Nordstrom-Robinson code (Nordstrom & Robinson 1967): 256 words, distance 6, corrects 2.
/// - "matrix6x6": 24 cells and one light circle opposite of the L's corner; extended Golay code (Golay 1949): 4096
///   words, distance 8, corrects 3.
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
  /// Least number of cells in which two of ids() differ, over all four rotations of one of them.
  int minimum_distance() const noexcept;

  /// The cells of an id, grid x grid, row-major from the top left. Error{invalid_argument} where !has(id).
  std::vector<Cell> cells(int id) const;

  /// Reads grid x grid cells in any rotation. Circle families only. nullopt where no id, or more than one, is within the
  /// family's power: 2 · wrong + erased < distance, and for "paper4x4" nothing may be wrong or erased. `strength` (0 … 1)
  /// lowers how many wrong cells are corrected: 0 accepts none.
  std::optional<DecodedTarget> decode(std::span<const Cell> cells, double strength = 1) const;

  bool operator==(const TargetFamily& other) const noexcept { return name() == other.name(); }

 private:
  struct Impl;
  explicit TargetFamily(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace lumihull::calib
