#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/color_key.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/ellipse.h>
#include <lumihull/calib/target_set.h>

#include <memory>
#include <optional>

namespace lumihull::calib {

struct LUMIHULL_API DetectOptions {
  /// Ink (object) against enclosure and paper (background): the paper's way, section 3.2. Without: adaptive contrast.
  std::optional<ColorKey> ink_key;
  double min_circle_px = 4.5;  ///< smallest minor axis (full, not half) that is looked for, >= 3
  double correct = 1;          ///< of the code's power to correct wrong cells that is used, 0 … 1
  bool refine = true;          ///< measure contours to the bound (fit_ellipse); else the dual-conic fit alone
  EllipseOptions ellipse;

  void validate() const;
};

/// Finds, reads and measures the targets of a set in photographs. Immutable: any number of threads may detect.
class LUMIHULL_API TargetDetector {
 public:
  /// Errors: invalid_argument (set, options), unsupported (a design with solid_light whose paper is nearly
  /// as light as bare paper).
  explicit TargetDetector(TargetSet set, DetectOptions options = {});
  TargetDetector(TargetDetector&&) noexcept;
  ~TargetDetector();

  const TargetSet& set() const;

  /// photo: any size, type, 1, 3 or 4 channels; sRGB. The answer does not depend on the number of threads.
  Detections detect(const Image& photo, Job& job) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// The photograph (as 8-bit RGB) with what was found drawn in: contours, ids, axes, refused candidates, and residuals about
/// each target's homography magnified `magnify` times.
LUMIHULL_API Image draw_detections(const Image& photo, const TargetSet& set, const Detections& found,
                                   double magnify = 100);

}  // namespace lumihull::calib
