#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/export.h>

#include <vector>

namespace lumihull::calib {

/// The targets' points of a calibrated capture as tracks, for export_colmap: each point in the world and where it was
/// measured. Circles: the centre, and the measured ellipse's centre moved by what lies between an ellipse's centre and
/// the picture of the circle's centre (circle_projection.h). Observations that calibration removed, and points that
/// fewer than two photographs see, are left out. Empty where the capture has no targets.json. Errors: bad_input.
LUMIHULL_API std::vector<Track> target_tracks(const Capture& capture);

}  // namespace lumihull::calib
