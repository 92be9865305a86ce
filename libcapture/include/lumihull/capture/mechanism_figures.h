#pragma once

#include <lumihull/capture/workspace.h>

#include <string>

namespace lumihull::capture {

// Pictures of a mechanism and of what it reaches: SVG files of their own, as text.

/// The room from above and from the front (along y), one scale: departure points, cables and platform at a view, the
/// hemisphere, the object. Azimuth and step index the workspace.
LUMIHULL_API std::string draw_mechanism(const Mechanism& mechanism, const Workspace& workspace, const KeepOut* object,
                                        int azimuth, int step);

enum class WorkspaceValue : std::uint8_t { balance, least_tension, clearance, sight, rotation_sensitivity };

/// A map over azimuth and polar angle, a cell a pose. Crossings are marked where they happen: between two poses.
LUMIHULL_API std::string draw_map(const WorkspaceReport& report, WorkspaceValue value);

/// The tension of each cable along φ at one azimuth, N; gaps where the platform is not balanced.
LUMIHULL_API std::string draw_tensions(const WorkspaceReport& report, const Mechanism& mechanism, int azimuth);

/// How far the platform may tilt at each φ, least and greatest over the azimuths, with the tilt that the workspace's
/// law wants and the one that a camera without offset would.
LUMIHULL_API std::string draw_tilt_ranges(const Mechanism& mechanism, const Workspace& workspace,
                                          double least_tension_N, Job& job);

}  // namespace lumihull::capture
