#pragma once

#include <lumihull/base/job.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/statics.h>

#include <cstddef>
#include <numbers>
#include <vector>

namespace lumihull::capture {

/// Where the platform stands for the view (theta, phi) of a hemisphere, and how it is turned:
///   p = center + radius (sin φ cos θ, sin φ sin θ, cos φ),  Q = Rz(θ) Ry(φ_t) Rz(-θ),  φ_t = f φ + δ
/// (paper, 2.1 and eq. 6). Q has no torsion: its axis is horizontal. With f = 1 and δ = 0 the platform's z axis points
/// away from the centre.
LUMIHULL_API Pose platform_pose(const Eigen::Vector3d& center, double radius_m, double theta_rad, double phi_rad,
                                double tilt_factor, double tilt_offset_rad);

/// The grid of poses over which a mechanism is judged, in the order of the paper's procedure (2.2): azimuths in turn,
/// down each from `first_phi_rad` to `last_phi_rad`.
struct Workspace {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_m = 1.5;
  int azimuths = 24;     ///< θ_j = 2 π j / azimuths
  int polar_steps = 10;  ///< evenly spaced, both ends included; >= 2
  double first_phi_rad = 0, last_phi_rad = std::numbers::pi / 2;
  double tilt_factor = 2.0 / 3, tilt_offset_rad = -std::numbers::pi / 6;  ///< f and δ of the paper

  std::size_t size() const { return std::size_t(azimuths) * std::size_t(polar_steps); }
  double theta(int azimuth) const { return 2 * std::numbers::pi * azimuth / azimuths; }
  double phi(int step) const { return first_phi_rad + (last_phi_rad - first_phi_rad) * step / (polar_steps - 1); }
  Pose pose(int azimuth, int step) const {
    return platform_pose(center, radius_m, theta(azimuth), phi(step), tilt_factor, tilt_offset_rad);
  }
};

/// f and δ for a tilt that goes evenly from first to last while φ goes from 0 to 90° (eq. 6).
LUMIHULL_API void set_tilt(Workspace& workspace, double first_tilt_rad, double last_tilt_rad);

}  // namespace lumihull::capture
