#pragma once

#include <lumihull/rig/simulate.h>

#include <string>

namespace lumihull::rig {

/// Everything that decides what is photographed, as simulate.json holds it.
std::string options_json(const SimulateOptions& options);

}  // namespace lumihull::rig
