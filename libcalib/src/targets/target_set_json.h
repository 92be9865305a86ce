#pragma once

// Target sets as JSON values, for files that hold one among other things.

#include <lumihull/calib/target_set.h>
#include <lumihull/internal/json.h>

namespace lumihull::calib::internal {

/// Errors: bad_input.
TargetSet read_target_set(const lumihull::internal::JsonReader& json);
lumihull::internal::Json json_of(const TargetSet& set);

}  // namespace lumihull::calib::internal
