#pragma once

#include <lumihull/base/job.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/sensitivity.h>
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

/// Error{invalid_argument} naming the first value that is not finite or outside its range.
LUMIHULL_API void check(const Workspace& workspace);

/// The least of all distances.
LUMIHULL_API double least_clearance_m(const Clearance& clearance);

/// One pose of a workspace, judged.
struct PoseReport {
  Tensions tensions;
  Clearance clearance;
  Sensitivity sensitivity;  ///< infinite where not controlled
  /// Smallest angle at the camera's centre between a cable and the cone in which the object's bounding sphere (its
  /// keep-out's cap) is seen, rad; negative: a cable is in front of the object. Without an object: to the line of
  /// sight.
  double sight_rad = 0;
  std::optional<Crossing> crossing;  ///< on the way to the next pose

  bool balanced() const { return tensions.balance == Balance::controlled || tensions.balance == Balance::loose; }
};

struct LUMIHULL_API WorkspaceReport {
  Workspace workspace;
  std::vector<PoseReport> poses;  ///< workspace.size(): azimuths in turn, polar steps within each

  const PoseReport& at(int azimuth, int step) const {
    return poses[std::size_t(azimuth) * std::size_t(workspace.polar_steps) + std::size_t(step)];
  }
  /// Φ of the paper's eq. 1: poses with a crossing after them minus balanced poses; the ideal is -workspace.size().
  int paper_objective() const;
  /// Share of poses that are balanced with tensions and clearances of at least these, and no crossing after them.
  double coverage(double least_tension_N, double clearance_m) const;
};

/// Judges every pose. The way from a pose leads to the next one of the procedure: down along an azimuth; from its end
/// to the end of the next azimuth, up which the robot goes as it came down (paper, 2.2); from the last azimuth's end
/// nowhere.
LUMIHULL_API WorkspaceReport examine(const Mechanism& mechanism, const Workspace& workspace, const KeepOut* object,
                                     Job& job);

/// Φ alone (paper, eq. 1), much faster. s = 1 where balance is controlled or loose: a pose that is balanced though no
/// cable resists some motion does not count, or six cables at one point would be ideal.
LUMIHULL_API int paper_objective(const Mechanism& mechanism, const Workspace& workspace);

/// How far the platform may tilt, without torsion, towards the view's azimuth (positive: top outwards) and away from
/// it, while every tension stays >= least_tension_N on the way from 0; steps of one degree up to 90°. NaN for both
/// where tilt 0 is not balanced.
struct TiltRange {
  double low_rad = 0, high_rad = 0;
};
LUMIHULL_API TiltRange tilt_range(const Mechanism& mechanism, const Workspace& workspace, int azimuth, int step,
                                  double least_tension_N = 0);

}  // namespace lumihull::capture
