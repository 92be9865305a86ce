#include "stored_plan.h"

#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/session.h>

#include <system_error>

#include "../plan/plan_json.h"

namespace lumihull::capture::internal {

namespace fs = std::filesystem;

namespace {

bool same_plan(const Plan& a, const Plan& b) {
  return print_plan(a, "plan") == print_plan(b, "plan");  // numbers are printed so that they read back the same
}

}  // namespace

JournalHead head_of(const Plan& plan, const std::string& names, const std::string& plan_sha256) {
  JournalHead head;
  head.plan_sha256 = plan_sha256;
  head.name_template = names;
  head.cameras = plan.cameras;
  for (const PlannedStop& stop : plan.stops) {
    head.stops.push_back(stop.name);
    if (!stop.photograph) head.passed.insert(stop.name);
  }
  return head;
}

std::optional<JournalState> stored_state(const fs::path& folder, const Plan& plan) {
  JournalState state;
  try {
    state = read_journal(journal_path(folder));
  } catch (const Error& e) {
    if (e.code() == ErrorCode::not_found) return std::nullopt;
    throw;
  }
  const fs::path stored = plan_path(folder);
  if (sha256_of_file(stored) != state.head.plan_sha256)
    throw Error(ErrorCode::bad_input, "it was changed after the capture was begun with it: put the old one back",
                stored.string());
  if (!same_plan(read_plan(stored), plan))
    throw Error(ErrorCode::bad_input,
                "the capture was begun with another plan (its plan.json): go on with that one, or name another folder",
                folder.string());
  return state;
}

Journal begin(const fs::path& folder, const Plan& plan, const std::string& names) {
  const fs::path stored = plan_path(folder);
  std::error_code error;
  if (!fs::exists(stored, error))
    write_plan(plan, stored);
  else if (!same_plan(read_plan(stored), plan))
    throw Error(ErrorCode::bad_input, "another plan is in the way: name another folder", stored.string());
  return Journal::create(journal_path(folder), head_of(plan, names, sha256_of_file(stored)));
}

}  // namespace lumihull::capture::internal
