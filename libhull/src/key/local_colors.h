#pragma once

#include <lumihull/base/image.h>

#include "coarse_hull.h"
#include "paper_colors.h"
#include "shadows.h"

namespace lumihull::hull {

/// What else is known of a photograph; nullptr: nothing.
struct Clues {
  const PaperColors* paper = nullptr;  ///< colours that are background on sheets alone
  const Image* sheet_parts = nullptr;  ///< coarse: where there are sheets (SheetPart), if paper is known
  const Shadows* shadows = nullptr;
};

/// Decides anew those pixels of a mask that the other views' hull contradicts: background before it, object beside it,
/// and what lies between it and a hull so forgiving that it holds all that may be object.
///
/// The evidence is how often a pixel's colour occurs on the object and in the background nearby, and how deep in the
/// hull its ray comes. Then neighbours of like colour agree, so that the outline comes to lie on the photograph's
/// edges: a few rounds of mean-field inference with contrast-sensitive neighbours (as Krähenbühl & Koltun 2011, but
/// only with the eight around).
///
/// Elsewhere than on sheets the background's colours are those of what is seen beside sheets nearby.
///
/// mask, photo: 8 bits, whole or as coarse as the view, whose mask counts for its size only. least: 0, or so deep must
/// the mask show background for more than specks to be doubted at all; then object and what lies beside the hull are
/// not. Returns how many pixels became object.
std::size_t decide_by_surroundings(Image& mask, const Image& photo, const CoarseView& view, const CoarseHull& hull,
                                   const CoarseHull& wide, const Clues& clues, int least);

}  // namespace lumihull::hull
