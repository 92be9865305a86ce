#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/pose.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/target_family.h>

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::calib {

/// One kind of target: its family and its size as printed.
///
/// A target's own frame: origin in the middle of its grid (square: of its black square), x to the right, y down, z into
/// the paper, metres. A camera that looks at it straight and upright has cam_from_target = identity but for the
/// distance.
struct LUMIHULL_API TargetDesign {
  TargetFamily family = TargetFamily::by_name("matrix5x5");
  double size_m = 0.036;            ///< circles: pitch, from one centre to the next; square: side of the black square
  double circle_diameter_m = 0;     ///< outer diameter; 0: half of the pitch. Circles only
  double ring_diameter_m = 0;       ///< diameter of a ring's light centre; 0: 0.55 of the outer one. Circles only
  bool solid_light = false;         ///< light cells are discs lighter than the paper, without a ring. Circles only
  double scale_x = 1, scale_y = 1;  ///< of the print: true length / drawn length along the target's x and y
  Rgb ink{0, 70, 30};               ///< what it is printed in
  Rgb paper{150, 205, 150};         ///< and on

  double circle_radius_m() const { return 0.5 * (circle_diameter_m > 0 ? circle_diameter_m : 0.5 * size_m); }
  double ring_radius_m() const { return ring_diameter_m > 0 ? 0.5 * ring_diameter_m : 0.55 * circle_radius_m(); }

  /// How many features a target has: grid² circles, or 4 corners.
  int features() const { return family.kind() == TargetKind::circles ? family.grid() * family.grid() : 4; }
  /// A feature's place in the target's frame, m, the print's scale applied. Circles: row-major from the top left.
  /// Corners: top left, top right, bottom right, bottom left.
  Eigen::Vector2d feature(int index) const;

  /// Throws Error{invalid_argument} naming the field.
  void validate() const;
};

/// A target on a body: a sheet of paper, a board, a box with targets on its faces.
struct BoardTarget {
  int design = 0;  ///< index into TargetSet::designs
  int id = 0;
  Pose board_from_target;  ///< metres
};

/// A field of points without ids: circles (dark discs) or the inner corners of a chessboard. Points are row-major; the
/// frame's origin is the first point, x along a row, y down the columns, z into the paper. Of a chessboard as it is
/// printed the field above and to the left of the first point is dark.
struct PointGrid {
  enum class Kind : std::uint8_t { circles, chessboard };
  Kind kind = Kind::chessboard;
  int columns = 0, rows = 0;  ///< points along x and y, 2 … 100
  double spacing_m = 0;
  double circle_diameter_m = 0;  ///< circles only; 0: half of the spacing
  double circle_radius_m() const { return 0.5 * (circle_diameter_m > 0 ? circle_diameter_m : 0.5 * spacing_m); }
  Eigen::Vector2d point(int index) const { return {index % columns * spacing_m, index / columns * spacing_m}; }
};

/// A rigid body with targets on it whose places are known.
struct Board {
  std::string name;
  std::vector<BoardTarget> targets;
};

/// What was printed, and what is known of how it lies: what the detector and the adjustment read.
///
/// It may not contradict itself: an id stands on one board once; no two targets look alike in any rotation, be they of
/// one family or of two (aruco:6x6_50 begins as aruco:6x6_250 does); targets of a board do not cover each other;
/// without boards, no two designs share a target; grids differ in kind or numbers of points.
struct LUMIHULL_API TargetSet {
  std::vector<TargetDesign> designs;
  std::vector<Board> boards;     ///< empty: any id of the designs may be anywhere
  std::vector<PointGrid> grids;  ///< for lens calibration

  /// From a word: FAMILY:SIZE as "matrix5x5:18mm" (pitch), "aruco:6x6_250:35mm", "apriltag:36h11:50mm" (side of the
  /// black square), "chessboard:9x6:25mm" (inner corners along x and y, side of a field), "circles:11x8:15mm" (points,
  /// spacing); sizes in mm, cm, m or in. Several words are joined by commas. Errors: invalid_argument.
  static TargetSet from_word(std::string_view word);
  /// Reads a file ("lumihull-targets", version 1; its fields are called as the members here, poses are {"q": [w, x, y,
  /// z], "t": [x, y, z]}). Errors: not_found, io, bad_input (names the file, the JSON pointer and what was expected;
  /// fields that are not known are refused, too).
  static TargetSet load(const std::filesystem::path& file);
  /// A word, or a file where `text` names one (ends with ".json" or exists).
  static TargetSet from_text(const std::string& text);
  /// Errors: invalid_argument (see validate), bad_input (a name that is not UTF-8), io.
  void save(const std::filesystem::path& file) const;

  /// Throws Error{invalid_argument}; its subject is the place as a JSON pointer, "/boards/1/targets/0/id".
  void validate() const;
};

}  // namespace lumihull::calib
