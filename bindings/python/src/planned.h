#pragma once

#include <lumihull/capture/planner.h>

namespace lumihull::python {

/// A plan with what planning told about it.
struct Planned {
  capture::PlannedTour tour;
  capture::PoseLimits limits;
};

}  // namespace lumihull::python
