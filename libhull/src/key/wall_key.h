#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>

#include <optional>
#include <span>

#include "coarse_hull.h"
#include "paper_colors.h"
#include "sheets.h"

namespace lumihull::hull {

/// Finds out how far paper reaches around each sheet's print: as long as its margin has paper's colours in views that
/// see it beside the hull. Where no view tells, the reach stays.
void measure_paper(std::span<Sheet> sheets, std::span<const CoarseView> views, std::span<const Image> photos,
                   const CoarseHull& hull, const PaperColors& paper, Job& job);

/// A key for places where no sheet hangs: without paper, ink, and all that lies between these and the walls.
///
/// Background samples of `key` are kept in proportion to how often their colour occurs beside sheets, as against on
/// sheets; a colour that the photographs show nowhere beside the hull stays (what the object hides). nullopt where
/// nothing would be left.
std::optional<calib::ColorKey> key_beside_sheets(const calib::ColorKey& key, std::span<const Sheet> sheets,
                                                 std::span<const CoarseView> views, std::span<const Image> photos,
                                                 const CoarseHull& hull, Job& job);

/// Makes object what `beside_sheets` says is none of the enclosure, where there is no sheet. edges: along edges, too,
/// where object and background run into each other. mask, photo: 8 bits, of one size, whole or as coarse as
/// sheet_parts.
void key_places(Image& mask, const Image& photo, const Image& sheet_parts, const calib::ColorKey& beside_sheets,
                bool edges);

}  // namespace lumihull::hull
