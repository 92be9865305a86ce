#pragma once

// targets.json as text: parsing and printing apart from the disk, so that both can be fuzzed.

#include <lumihull/calib/target_model.h>

#include <string>
#include <string_view>

namespace lumihull::calib::internal {

/// `name` stands for the file in errors. Errors: bad_input.
LUMIHULL_API TargetModel parse_target_model(std::string_view text, const std::string& name);
/// Errors: bad_input (a text that is not UTF-8).
LUMIHULL_API std::string print_target_model(const TargetModel& model, const std::string& name);

}  // namespace lumihull::calib::internal
