#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/background.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/target_set.h>

namespace lumihull::calib {

/// Samples of targets' ink and of what is around it, from photographs in which targets were found without a key (by
/// adaptive contrast): the two training sets of the paper's way to extract targets (section 3.2), without a hand-drawn
/// region. `add` may be called by any number of threads; the key does not depend on the order.
class LUMIHULL_API InkSamples {
 public:
  /// photo: 3 or 4 channels, sRGB (Error{invalid_argument}: grey). Ink: pixels well inside of dark circles that were
  /// measured. Around: paper between the circles, and everything that is a pitch away from all that was found or refused.
  /// Designs of squares add nothing.
  void add(const Image& photo, const TargetSet& set, const Detections& found);

  std::uint64_t ink_pixels() const noexcept { return ink_.total(); }

  /// A key whose foreground is the ink; k neighbours, at most 20,000 samples of ink and 100,000 of the rest. Colours that make
  /// up a larger part of the ink than of the rest are no samples of the rest: ink may stand there, too.
  /// Errors: degenerate (fewer than 1000 pixels of ink: no target, or only small ones).
  ColorKey train(int k, Job& job) const;

 private:
  ColorHistogram ink_, around_;
};

}  // namespace lumihull::calib
