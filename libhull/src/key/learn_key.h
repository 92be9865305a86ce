#pragma once

#include <lumihull/base/capture.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/hull/auto_key.h>

#include <optional>
#include <span>
#include <vector>

#include "coarse_hull.h"
#include "repair_mask.h"

namespace lumihull::hull {

/// A key learned from photographs that show the object, and where the object is.
struct LearnedKey {
  calib::ColorKey key;
  std::optional<CoarseHull> hull;  ///< where cameras are known and agree on one
  int rounds = 0;                  ///< of carving and training again
  /// Before a dark enclosure, where shadows on the object look like it: a hull so forgiving that they do not carve it.
  std::optional<CoarseHull> solid;
  std::optional<MaskRepair> repair;  ///< where at least five of the photographs have a camera
};

/// Every step-th pixel of an 8-bit picture, so that at most 0.5 million are left: noise stays what it is.
Image thinned(const Image& photo, int step);
int thinning_step(int width, int height);

/// Trains on the photographs of the given shots. First without cameras (calib::background_of_photos); where at least
/// three of the shots are positioned, what lies outside of the hull of the silhouettes so far is background, and
/// training is repeated until the silhouettes settle.
LearnedKey learn_key(const Capture& capture, std::span<const std::size_t> shots, const KeyOptions& options, Job& job);

}  // namespace lumihull::hull
