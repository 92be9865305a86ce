#pragma once

// Options' ranges, for this folder's checks.

#include <lumihull/base/error.h>

#include <cmath>
#include <cstdio>

namespace lumihull::capture::internal {

/// Error{invalid_argument} with `name` as its subject where a value is not finite or not within low … high.
inline void expect_between(double value, double low, double high, const char* name) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  char text[160];
  std::snprintf(text, sizeof text, "expected a number from %g to %g, not %g", low, high, value);
  throw Error(ErrorCode::invalid_argument, text, name);
}

}  // namespace lumihull::capture::internal
