#pragma once

// The structures of lumihull_capture.h that several files need.

#include <lumihull.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/plan.h>

#include <optional>

namespace lumihull::capi {

/// NULL: none. Its range is for those who use it.
std::optional<capture::KeepOut> keep_out_from(const lh_keep_out* user, const char* name);

lh_stop stop_to(const capture::PlannedStop& stop);

}  // namespace lumihull::capi
