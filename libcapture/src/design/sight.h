#pragma once

#include <lumihull/capture/mechanism.h>

namespace lumihull::capture::design {

/// Smallest angle at the camera's centre between a cable and the cone of a ball about `center`, rad; negative inside.
double sight_rad(const Mechanism& mechanism, const Pose& world_from_platform, double bearing_rad,
                 const Eigen::Vector3d& center, double ball_radius_m);

}  // namespace lumihull::capture::design
