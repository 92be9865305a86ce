#pragma once

#include <lumihull/base/job.h>
#include <lumihull/rig/simulate.h>

#include <filesystem>
#include <string>
#include <vector>

namespace lumihull::rig {

/// A photograph of the capture and the exposure that it is.
struct NamedExposure {
  std::string name;
  ExposureRecord exposure;
};
/// In the plan's order, of the newest take of each. Error{bad_input} where a photograph's exposure is not on record.
std::vector<NamedExposure> exposures_of(const std::filesystem::path& folder);

/// Brings truth/ up to date with the journal: cameras.json, masks/, depth/, mesh.ply, targets.json, highlights.json.
void write_session_truth(const std::filesystem::path& folder, const RigSession& session,
                         const std::vector<NamedExposure>& exposures, Job& job);

}  // namespace lumihull::rig
