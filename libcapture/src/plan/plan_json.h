#pragma once

// plan.json as text: parsing and printing apart from the disk, so that both can be fuzzed.

#include <lumihull/capture/plan.h>

#include <string>
#include <string_view>

namespace lumihull::capture::internal {

/// The text of plan.json, checked. `file` is named in complaints. Errors: bad_input.
LUMIHULL_API Plan parse_plan(std::string_view text, const std::string& file);
/// Errors: bad_input (what `check` refuses, a text that is not UTF-8).
LUMIHULL_API std::string print_plan(const Plan& plan, const std::string& file);

}  // namespace lumihull::capture::internal
