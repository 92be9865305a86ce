#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "coarse_hull.h"

namespace lumihull::hull {

/// Which colours are rare in the background that one photograph shows.
class RareColors {
 public:
  /// photo: 8 bits, 3 channels; outside: 255 where it shows background, the same size.
  RareColors(const Image& photo, const Image& outside);
  /// rgb: 3 bytes. True where 97 % of the background have a colour that occurs more often (among its like).
  bool rare(const std::uint8_t* rgb) const { return density_[bin(rgb)] <= rarest_; }

 private:
  static std::size_t bin(const std::uint8_t* rgb) {
    return (std::size_t(rgb[0] >> 2) << 12) | (std::size_t(rgb[1] >> 2) << 6) | std::size_t(rgb[2] >> 2);
  }
  std::vector<float> density_;  ///< 64³ bins, each a mean of itself and its neighbours
  float rarest_ = 0;
};

/// Mends masks where the object took on the enclosure's colour (light that the enclosure throws on a pale or shiny
/// surface), by what the other views say.
///
/// A hull is carved that one view alone can't carve (with many views: a few). Where a mask shows background before the
/// depth of that hull, nearly all others contradict it: an outline of its own right cuts off only the thin shavings
/// that no other view saw. A hole that is there, but that hardly any other view looks through, is told by its colours:
/// they are those that this photograph shows beside the object. Bleeding brings colours near the enclosure's, but
/// hardly ever these.
class MaskRepair {
 public:
  /// views: their masks as keyed, and mended in place (but where `fixed`); photos: the same pictures, 8 bits, 3
  /// channels. Hull and masks improve each other in a few rounds. nullopt where nothing can be said: less than five
  /// views, or no hull.
  static std::optional<MaskRepair> learn(std::span<CoarseView> views, std::span<const Image> photos,
                                         std::span<const std::uint8_t> fixed, Job& job);

  /// Whether a coarse mask shows background where the hull's core is: hardly any does, and the rest need no `find`.
  bool contradict(const CoarseView& view) const;

  /// What of a coarse mask is object although keyed as background.
  struct Patch {
    Image pixels;  ///< 8 bits, 1 channel, coarse: 255 where it is
    Image reach;   ///< 255 where, beside `pixels`, rare colours are object as well
    RareColors colors;
  };
  /// nullopt: nothing. photo: thinned like the view's mask.
  std::optional<Patch> find(const CoarseView& view, const Image& photo) const;

 private:
  explicit MaskRepair(CoarseHull hull) : hull_(std::move(hull)) {}
  CoarseHull hull_;
};

/// Sets to 255 what a patch calls object. mask and photo: whole, 8 bits.
void mend(Image& mask, const Image& photo, const MaskRepair::Patch& patch, int step);

}  // namespace lumihull::hull
