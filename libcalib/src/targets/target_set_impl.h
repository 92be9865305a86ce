#pragma once

// Target sets as text: parsing and printing apart from the disk, so that both can be fuzzed.

#include <lumihull/calib/target_set.h>

#include <functional>
#include <string>
#include <string_view>

namespace lumihull::calib::internal {

/// Told of a contradiction: where (a JSON pointer, e.g. "/boards/2/targets/1/id") and what was expected there. Throws.
using Complain = std::function<void(const std::string& pointer, const std::string& expected)>;

void check_design(const TargetDesign& design, const std::string& pointer, const Complain& complain);
void check_grid(const PointGrid& grid, const std::string& pointer, const Complain& complain);
void check_set(const TargetSet& set, const Complain& complain);
/// No two targets of a board may lie over one another: the same place on the same side of one plane.
void check_overlaps(const TargetSet& set, const Board& board, const std::string& pointer, const Complain& complain);

/// `name` stands for the file in errors. Errors: bad_input.
LUMIHULL_API TargetSet parse_target_set(std::string_view text, const std::string& name);
/// Errors: bad_input (a name that is not UTF-8).
LUMIHULL_API std::string print_target_set(const TargetSet& set, const std::string& name);

}  // namespace lumihull::calib::internal
