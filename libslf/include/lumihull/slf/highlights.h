#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull::slf {

/// A lamp's mirror image on an object, as it is known to be.
struct Highlight {
  int lamp = 0;
  Eigen::Vector2d pixel{0, 0};  ///< (0.5, 0.5) = centre of the first pixel
  double strength = 0;          ///< luminance that it adds there, 1 = white
};

/// The highlights of one view.
struct ViewHighlights {
  std::string name;
  std::vector<Highlight> highlights;
};

/// Reads the truth that the virtual rig writes:
///
///     {"format": "lumihull-highlights", "version": 1,
///      "shots": [{"name": "test_0001", "highlights": [{"lamp": 0, "point": [x, y, z], "pixel": [u, v], "strength":
///      s}]}]}
///
/// Errors: not_found, bad_input naming file, JSON pointer and what was expected.
LUMIHULL_API std::vector<ViewHighlights> read_highlights(const std::filesystem::path& file);

/// How well pictures' highlight moves like the true one.
struct HighlightPath {
  int lamp = 0;
  std::size_t views = 0;      ///< in which it truly is
  std::size_t found = 0;      ///< in which the pictures show it, at least 30 % as strong as the photographs do
  double true_length_px = 0;  ///< of its way from view to view
  double share = 0;           ///< of that length which the pictures' highlight goes along with
  double rms_px = 0;          ///< distance from its true place, over the views where it was found
};

/// Follows the highlight of the lamp that is strongest over all views. `pictures`, `photographs`: the same views in
/// order, 8-bit RGB or RGBA; `matt`: the same without any gloss (the mean colour). What a picture has more in luma than
/// `matt`, smoothed by 1 % of the picture's shorter side, is its gloss; the highlight is where that is largest within 8
/// % of that side around the true place (its centroid above half the maximum). A step from one view to the next counts
/// by its part along the true step, from 0 to the true step's length; steps from or to views without highlight count 0.
/// Errors: invalid_argument (counts, sizes), degenerate (no two views in a row have the highlight).
LUMIHULL_API HighlightPath follow_highlight(std::span<const Image> pictures, std::span<const Image> photographs,
                                            std::span<const Image> matt, std::span<const ViewHighlights> truth);

}  // namespace lumihull::slf
