#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/calibrate.h>
#include <lumihull/calib/color_key.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "coarse_hull.h"
#include "local_colors.h"
#include "paper_colors.h"
#include "shadows.h"
#include "sheets.h"

namespace lumihull::hull {

/// Mends masks by what the other views say: where the object took on the enclosure's colour or that of the sheets in
/// it, and where a mask holds what none of the others does.
///
/// Two hulls are carved: one that a single view can't carve (with many views: a few), and one that hardly a third of
/// them can, which holds all that may be object. What a mask contradicts is decided by the colours around
/// (decide_by_surroundings); better masks carve a better hull.
class MaskRepair {
 public:
  /// What there is to learn from.
  struct Source {
    std::span<const CoarseView> views;              ///< their masks as keyed
    std::span<const Image> photos;                  ///< the same pictures, thinned, 8 bits, 3 channels
    std::span<const std::uint8_t> fixed;            ///< 1: a mask that votes and is not changed
    std::span<const calib::CalibratedBody> sheets;  ///< targets as solved, if known
    const calib::ColorKey* key = nullptr;           ///< that made the masks; must be given where sheets are known
    std::optional<calib::Rgb> background;           ///< whose shadows are taken off; none: the masks are without them
    /// 0; or so many voxels deep must a mask show background to be doubted, where the key was learned from the
    /// photographs: it knows the colours at the hull's rim.
    int least_deep = 0;
  };
  /// nullopt where nothing can be said: less than five views, or no hull.
  static std::optional<MaskRepair> learn(const Source& source, Job& job);

  /// Mends a mask. mask, photo: whole, 8 bits, undecided edges; view: of it, coarse, its mask of the right size.
  /// True where more than specks became object.
  bool mend(Image& mask, const Image& photo, const CoarseView& view) const;

 private:
  MaskRepair(CoarseHull hull, CoarseHull wide) : hull_(std::move(hull)), wide_(std::move(wide)) {}
  static std::optional<MaskRepair> carve(std::span<const CoarseView> views, Job& job);
  void learn_sheets(const Source& source, Job& job);
  void abstain_on_sheets(const CoarseView& view, const Image& photo, const Image& parts, Image& mask) const;
  Clues clues(const Image& parts) const;

  CoarseHull hull_, wide_;
  std::vector<Sheet> sheets_;
  std::optional<PaperColors> paper_;
  std::optional<calib::ColorKey> beside_sheets_;
  std::optional<Shadows> shadows_;
  int least_deep_ = 0;
};

}  // namespace lumihull::hull
