#pragma once

// From a simulated capture to a model, beside the truth.

#include <lumihull/base/capture.h>
#include <lumihull/rig/simulate.h>

#include "experiment.h"

namespace lumihull::experiments {

/// Photographs (or goes on with) a capture in `folder`, and does all its stages: calibrate, key, hull (150 voxels, as
/// the paper), texture, light field, the comparison with the truth, the report. `change`: options of the stages, set
/// before they run. Returns figures: photographs, seconds of each stage beside the paper's, and "truth".
Json model_of(const std::filesystem::path& folder, const rig::SimulateOptions& options, const Size& size, Job& job,
              const std::function<void(Capture&)>& change = {});

/// A photograph, its silhouette, its targets, the hull, two views of the light field: as the paper's figures 6 and 10.
Image overview(const Capture& capture, Job& job, int height = 220);

}  // namespace lumihull::experiments
