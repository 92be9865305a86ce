#pragma once

#include <lumihull/capture/mechanism.h>
#include <lumihull/internal/json.h>

#include <string_view>

// A mechanism's fields in JSON: in a file of its own, and as a part of a plan.

namespace lumihull::capture::internal {

/// Every field must be there. Whether the values make a mechanism is for `check`, which both callers ask next.
Mechanism read_mechanism_fields(const lumihull::internal::JsonReader& json);
lumihull::internal::Json print_mechanism_fields(const Mechanism& mechanism);

/// The text of mechanism.json, checked. `file` is named in complaints.
Mechanism parse_mechanism(std::string_view text, const std::string& file);
std::string print_mechanism(const Mechanism& mechanism, const std::string& file);

}  // namespace lumihull::capture::internal
