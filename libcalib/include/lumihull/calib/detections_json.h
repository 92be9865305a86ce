#pragma once

#include <lumihull/base/api.h>
#include <lumihull/calib/detection.h>
#include <lumihull/calib/target_set.h>

#include <span>
#include <string>
#include <string_view>

namespace lumihull::calib {

/// Names of RefusedTarget::Reason, in their order: "no_code", …
LUMIHULL_API std::span<const std::string_view> refusal_names();

/// What was found in one photograph.
struct PhotoDetections {
  std::string photo;          ///< its name or path
  int width = 0, height = 0;  ///< px
  Detections found;
};

/// One JSON object on one line: photo, width, height, targets (design, family, id, corrected, erased, rms_px,
/// pixel_from_target, features with index, pixel, covariance xx xy yy, and of circles the dual conic's 00, 01, 11, 02,
/// 12), refused (how many for each reason). Errors: bad_input (a name that is not UTF-8).
LUMIHULL_API std::string detections_json(const TargetSet& set, const PhotoDetections& detections);

}  // namespace lumihull::calib
