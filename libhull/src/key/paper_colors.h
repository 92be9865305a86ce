#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "coarse_hull.h"
#include "sheets.h"

namespace lumihull::hull {

/// Colours of the enclosure that its walls do not have, but the sheets of targets on them.
///
/// An object's highlights have the colour of light paper. Photographs of the empty enclosure show paper and walls
/// alike; but a calibration knows where sheets hang, and so which colours occur there and not beside them.
class PaperColors {
 public:
  /// photos: the views' pictures, thinned, 8 bits, 3 channels. hull: where the object is. nullopt where no photograph
  /// shows a sheet beside the hull.
  static std::optional<PaperColors> learn(std::span<const Sheet> sheets, std::span<const CoarseView> views,
                                          std::span<const Image> photos, const CoarseHull& hull, Job& job);

  /// Whether a colour is hardly a wall's. Clipped colours are nobody's.
  bool is_paper(const std::uint8_t* rgb) const {
    return paper_[(std::size_t(rgb[0] >> 2) << 12) | (std::size_t(rgb[1] >> 2) << 6) | std::size_t(rgb[2] >> 2)] != 0;
  }

 private:
  std::vector<std::uint8_t> paper_;  ///< 64³ colours: 1 where it is one
};

}  // namespace lumihull::hull
