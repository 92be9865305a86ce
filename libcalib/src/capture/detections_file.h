#pragma once

// detections/NAME.json ("lumihull-detections", version 1) as text: parsing and printing apart from the disk, so that
// both can be fuzzed.

#include <lumihull/calib/detections_json.h>

#include <string>
#include <string_view>

namespace lumihull::calib::internal {

struct KeptDetections {
  std::string key;  ///< digest of everything that they depend on
  PhotoDetections detections;
};

/// What was refused is only counted in such a text: `refused` stays empty. Errors: bad_input (JSON pointer and what was
/// expected; a design, id or feature that the set does not have).
LUMIHULL_API KeptDetections parse_detections(std::string_view text, const std::string& name, const TargetSet& set);
LUMIHULL_API std::string print_detections(const TargetSet& set, const KeptDetections& kept);

}  // namespace lumihull::calib::internal
