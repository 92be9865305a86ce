#pragma once

#include <lumihull/calib/target_family.h>

#include <mutex>

namespace lumihull::calib {

/// The cells of a grid that differ from target to target, as bits: bit (row · side + column) is set where it is light.
/// Circle families: the whole grid. Square ones: what is inside of the black border.
using CellBits = std::uint64_t;

/// The grid turned clockwise by 90°.
CellBits turned(CellBits cells, int side) noexcept;

struct TargetFamily::Impl {
  std::string name;
  TargetKind kind = TargetKind::circles;
  int grid = 0;
  int side = 0;      ///< of the cells in `words`, <= 8
  int distance = 0;  ///< between upright words, for decoding; circle families only
  std::vector<int> ids;
  std::vector<CellBits> words;  ///< of ids[i]

  mutable std::once_flag distance_once;
  mutable int rotated_distance = 0;

  static std::shared_ptr<const Impl> make(std::string_view name);
  int index(int id) const;  ///< into ids; -1: not there
};

/// What a library knows of a square family: the words of the ids 0, 1, ….
struct SquareWords {
  int side = 0;
  std::vector<CellBits> words;
};

/// AprilTag's families, from its library: "36h11", …. nullopt: no such family. Errors: unsupported (a family with cells
/// outside of its border).
std::optional<SquareWords> apriltag_words(std::string_view name);
std::vector<std::string> apriltag_names();

/// ArUco's dictionaries, from OpenCV: "6x6_250", …, "original". nullopt: no such dictionary.
std::optional<SquareWords> aruco_words(std::string_view name);
std::vector<std::string> aruco_names();

}  // namespace lumihull::calib
