#pragma once

#include <lumihull/internal/json.h>
#include <lumihull/slf/evaluate.h>

namespace lumihull::slf {

/// null where the value is not finite.
internal::Json number_json(double value);
internal::Json test_views_json(const TestViewEvaluation& views);

}  // namespace lumihull::slf
