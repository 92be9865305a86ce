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
  int per_sheet = 1;          ///< 1 or 4 targets
  bool paint_paper = false;   ///< fill the sheet with the design's paper colour, for white paper; else it is left bare
  bool ids = true;            ///< each target's id, small, in plain text
  bool scale_bar = true;      ///< a bar of 150.0 mm, to be measured

  void validate() const;
};

/// Draws sheets of targets and says what they hold: a board for each sheet.
///
/// design.size_m = 0: as large as the sheet allows (5x5: 36 mm pitch on letter; four on a sheet: 18 mm; 6x6: 30 mm).
/// PDF: one file NAME.pdf with a page a sheet; SVG: NAME-1.svg, NAME-2.svg, … ; beside them NAME.json.
/// Errors: invalid_argument (ids that the family does not have, a size that does not fit), io, unsupported (no cairo).
LUMIHULL_API TargetSet write_target_sheets(const std::filesystem::path& stem, const TargetDesign& design,
                                           const std::vector<int>& ids, const std::vector<SheetFormat>& formats,
                                           const SheetOptions& options, Job& job);

/// The same for one sheet with a field of points for lens calibration (spacing_m = 0: as large as fits).
LUMIHULL_API TargetSet write_grid_sheet(const std::filesystem::path& stem, const PointGrid& grid,
                                        const std::vector<SheetFormat>& formats, const SheetOptions& options);

}  // namespace lumihull::calib
