#pragma once

// Where things stand on a sheet, in millimetres from its top left corner, y down.

#include <lumihull/calib/target_sheet.h>

#include <string>
#include <vector>

namespace lumihull::calib {

struct SheetLayout {
  double width = 0, height = 0;          ///< of the paper
  std::vector<Eigen::Vector2d> centers;  ///< of the targets or of the field of points
  double label_below = 0;                ///< baseline of a target's label below its ink's lower edge
};

inline constexpr double kBarLength = 150;   ///< of the scale bar
inline constexpr double kSheetMargin = 10;  ///< where printers may print nothing

/// Side of the square that a target's ink fills.
double ink_side_mm(const TargetDesign& design);
/// Width of what must stay free around the ink: a quarter of the pitch, or one module.
double quiet_mm(const TargetDesign& design);

/// The largest size in whole millimetres whose ink is at most 165 mm wide, or 82.5 mm with four on a sheet; squares
/// with a module's margin on either side within that.
double default_size_m(const TargetDesign& design, int per_sheet);

/// Errors: invalid_argument (too large, with the largest size that fits).
SheetLayout lay_out_targets(const TargetDesign& design, const SheetOptions& options);

/// Half-sizes of what a field's ink fills about its middle.
Eigen::Vector2d ink_half_mm(const PointGrid& grid);
/// The largest spacing in half millimetres that fits.
double default_spacing_m(const PointGrid& grid, const SheetOptions& options);
/// Upright or across, whichever leaves more room. Errors: invalid_argument.
SheetLayout lay_out_grid(const PointGrid& grid, const SheetOptions& options);

/// A length for people: "36 mm", "16.5 mm".
std::string millimetres(double length_m);

}  // namespace lumihull::calib
