#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/color_key.h>

#include <cstdint>

namespace lumihull::calib {

/// What becomes of the pixels at the silhouette's edge.
enum class EdgeMode : std::uint8_t {
  hard,   ///< 0 and 255 only: the pure decision
  soft,   ///< edge pixels carry their share of object; thresholding at 128 gives exactly the pure decision
  matte,  ///< as soft, but the share may move a mixed pixel across the threshold: contours at half coverage
};

struct LUMIHULL_API KeyImageOptions {
  EdgeMode edges = EdgeMode::soft;
  int smallest_object_px = 0;  ///< object components of fewer pixels become background (8-connected); 0: kept
  int largest_hole_px = 0;     ///< background components enclosed by object of up to so many pixels are filled; 0: kept

  /// Throws Error{invalid_argument} naming the option.
  void validate() const;
};

/// The silhouette of one photograph: 8 bits, 1 channel, 255 = object, 0 = background.
///
/// photo: 3 channels (4: alpha is ignored), sRGB. 8-bit values are keyed as they are; 16-bit values v as v / 257 and
/// float values v as 255 v, both rounded to nearest (float clamped to 0 … 1 first, NaN counts as 0).
/// Errors: invalid_argument (a photograph of 1 channel, options).
LUMIHULL_API Image key_image(const ColorKey& key, const Image& photo, const KeyImageOptions& options = {});

/// An 8-bit, 3-channel picture by the rule above (a copy where it already is one).
LUMIHULL_API Image keyable(const Image& photo);

/// Replaces the edge of a silhouette by coverage. `mask`: 8 bits, 1 channel, decisions as >= 128, to within a pixel of
/// the photograph's edges; `photo`: 8 bits, 3 channels, the same size.
///
/// In a pixel beside the decision's boundary the colour is c = α F + (1 − α) B; F and B are means over confident
/// pixels of a small window (those away from any boundary), as close by as can be, for a shiny object's rim mirrors
/// what is behind it; and α is the projection (c − B)·(F − B) / |F − B|², as in
/// Smith & Blinn 1996 for known B and F. Pixels without confident neighbours on both sides keep their decision.
LUMIHULL_API void soften_edges(Image& mask, const Image& photo, EdgeMode mode);

/// Removes specks and fills holes of a mask (8 bits, 1 channel; object: >= 128): object components (8-connected) of
/// fewer than `smallest_object_px` pixels become 0, background components (4-connected) of at most `largest_hole_px`
/// pixels that do not touch the picture's border become 255.
LUMIHULL_API void clean_mask(Image& mask, int smallest_object_px, int largest_hole_px);

}  // namespace lumihull::calib
