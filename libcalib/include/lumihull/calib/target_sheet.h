#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/target_set.h>

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::calib {

enum class Paper : std::uint8_t { letter, a4 };
enum class SheetFormat : std::uint8_t { pdf, svg };

struct LUMIHULL_API SheetOptions {
  Paper paper = Paper::letter;
  int per_sheet = 1;         ///< 1 or 4 targets
  bool paint_paper = false;  ///< fill the sheet with the design's paper colour, for white paper; else it is left bare
  bool ids = true;           ///< each target's id, and what the sheet holds, small, in plain text
  bool scale_bar = true;     ///< a bar of 150.0 mm, to be measured

  /// Throws Error{invalid_argument} naming the option.
  void validate() const;
};

/// Draws sheets of targets and says what they hold: a board for each sheet, in the order of `ids`.
///
/// A board's frame is its sheet's: origin in the upper left corner, x right, y down, z into the paper, metres; lengths
/// are true ones, drawn ones times the design's scale. Drawn places and sizes are right to 0.01 mm.
/// design.size_m = 0: as large as the sheet allows in whole millimetres (5x5: 36 mm pitch; 6x6: 30 mm; four on a sheet:
/// 18 mm and 15 mm; a black square with a white module around it: 165 mm, or 82 mm).
/// PDF: one file STEM.pdf with a page a sheet; SVG: STEM-1.svg, STEM-2.svg, … ; beside them, at last, STEM.json. Each
/// file is replaced atomically; the same arguments give the same bytes.
/// Errors: invalid_argument (ids that the family does not have or that are given twice, a size that does not fit,
/// solid_light without paint_paper), io, not_found (no such folder), cancelled.
LUMIHULL_API TargetSet write_target_sheets(const std::filesystem::path& stem, const TargetDesign& design,
                                           const std::vector<int>& ids, const std::vector<SheetFormat>& formats,
                                           const SheetOptions& options, Job& job);

/// The same for one sheet with a field of points for lens calibration (spacing_m = 0: as large as fits, in half
/// millimetres); per_sheet is not used. The paper lies across where that gives more room.
LUMIHULL_API TargetSet write_grid_sheet(const std::filesystem::path& stem, const PointGrid& grid,
                                        const std::vector<SheetFormat>& formats, const SheetOptions& options,
                                        const Rgb& ink = {0, 0, 0}, const Rgb& paper = {255, 255, 255});

}  // namespace lumihull::calib
