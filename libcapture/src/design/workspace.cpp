#include <lumihull/capture/workspace.h>

#include <cmath>

namespace lumihull::capture {

Pose platform_pose(const Eigen::Vector3d& center, double radius_m, double theta_rad, double phi_rad, double tilt_factor,
                   double tilt_offset_rad) {
  const double half = 0.5 * (tilt_factor * phi_rad + tilt_offset_rad), c = std::cos(theta_rad), s = std::sin(theta_rad),
               sine = std::sin(half);
  // Rz(θ) Ry(φ_t) Rz(-θ) turns by φ_t about Rz(θ) e_y.
  return {Eigen::Quaterniond(std::cos(half), -s * sine, c * sine, 0),
          center + radius_m * Eigen::Vector3d(std::sin(phi_rad) * c, std::sin(phi_rad) * s, std::cos(phi_rad))};
}

void set_tilt(Workspace& workspace, double first_tilt_rad, double last_tilt_rad) {
  workspace.tilt_factor = (last_tilt_rad - first_tilt_rad) / (std::numbers::pi / 2);
  workspace.tilt_offset_rad = first_tilt_rad;
}

}  // namespace lumihull::capture
