#pragma once

// The plan that a capture's folder was begun with.

#include <lumihull/capture/journal.h>
#include <lumihull/capture/plan.h>

#include <filesystem>
#include <optional>
#include <string>

namespace lumihull::capture::internal {

JournalHead head_of(const Plan& plan, const std::string& names, const std::string& plan_sha256);

/// The journal's state, where there is a journal; its plan must be `plan`. Error{bad_input}: another plan, a plan.json
/// that was changed, a damaged journal.
std::optional<JournalState> stored_state(const std::filesystem::path& folder, const Plan& plan);

/// Stores the plan, then begins the journal. Error{bad_input}: another plan.json is in the way.
Journal begin(const std::filesystem::path& folder, const Plan& plan, const std::string& names);

}  // namespace lumihull::capture::internal
