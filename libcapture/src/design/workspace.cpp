#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/capture/workspace.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "sight.h"

namespace lumihull::capture {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

bool is_balanced(Balance balance) { return balance == Balance::controlled || balance == Balance::loose; }

/// Where the robot goes after a pose; false after the last.
bool next_pose(const Workspace& w, int azimuth, int step, Pose& next) {
  if (step + 1 < w.polar_steps)
    next = w.pose(azimuth, step + 1);
  else if (azimuth + 1 < w.azimuths)
    next = w.pose(azimuth + 1, step);
  else
    return false;
  return true;
}

}  // namespace

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

void check(const Workspace& w) {
  const auto need = [](bool ok, const char* message) {
    if (!ok) throw Error(ErrorCode::invalid_argument, message, "workspace");
  };
  need(w.center.allFinite(), "expected a finite centre");
  need(w.radius_m > 0 && std::isfinite(w.radius_m), "expected a radius > 0");
  need(w.azimuths >= 1 && w.azimuths <= 3600, "expected 1 to 3600 azimuths");
  need(w.polar_steps >= 2 && w.polar_steps <= 3600, "expected 2 to 3600 polar steps");
  need(w.first_phi_rad >= 0 && w.first_phi_rad < w.last_phi_rad && w.last_phi_rad <= std::numbers::pi,
       "expected 0 <= first_phi_rad < last_phi_rad <= pi");
  need(std::isfinite(w.tilt_factor) && std::isfinite(w.tilt_offset_rad), "expected a finite tilt");
}

double least_clearance_m(const Clearance& c) {
  return std::min(
      {c.cable_cable, c.cable_platform, c.cable_camera, c.cable_object, c.platform_object, c.platform_room});
}

int WorkspaceReport::paper_objective() const {
  int sum = 0;
  for (const PoseReport& p : poses) sum += int(p.crossing.has_value()) - int(p.balanced());
  return sum;
}

double WorkspaceReport::coverage(double least_tension_N, double clearance_m) const {
  const auto good = std::count_if(poses.begin(), poses.end(), [&](const PoseReport& p) {
    return p.balanced() && !p.crossing && p.tensions.tension_N.minCoeff() >= least_tension_N &&
           least_clearance_m(p.clearance) >= clearance_m;
  });
  return poses.empty() ? 0 : double(good) / double(poses.size());
}

WorkspaceReport examine(const Mechanism& mechanism, const Workspace& workspace, const KeepOut* object, Job& job) {
  check(mechanism);
  check(workspace);
  WorkspaceReport report;
  report.workspace = workspace;
  report.poses.resize(workspace.size());
  job.begin("workspace", workspace.size());
  parallel_for(job, std::size_t(workspace.azimuths), [&](std::size_t azimuth) {
    for (int step = 0; step < workspace.polar_steps; ++step) {
      const int a = int(azimuth);
      PoseReport& out = report.poses[azimuth * std::size_t(workspace.polar_steps) + std::size_t(step)];
      const Pose pose = workspace.pose(a, step);
      out.tensions = tensions(mechanism, pose);
      out.clearance = clearance(mechanism, pose, object);
      out.sensitivity = sensitivity(mechanism, pose);
      out.sight_rad =
          design::sight_rad(mechanism, pose, workspace.theta(a), workspace.center, object ? object->radius_m : 0);
      Pose next;
      if (next_pose(workspace, a, step, next)) out.crossing = first_crossing(mechanism, pose, next);
      job.advance();
    }
  });
  job.end();
  return report;
}

int paper_objective(const Mechanism& mechanism, const Workspace& workspace) {
  int sum = 0;
  for (int a = 0; a < workspace.azimuths; ++a) {
    Pose pose = workspace.pose(a, 0), next;
    for (int step = 0; step < workspace.polar_steps; ++step) {
      sum -= int(is_balanced(static_test(mechanism, pose)));
      if (!next_pose(workspace, a, step, next)) break;
      sum += int(first_crossing(mechanism, pose, next).has_value());
      pose = next;
    }
  }
  return sum;
}

TiltRange tilt_range(const Mechanism& mechanism, const Workspace& workspace, int azimuth, int step,
                     double least_tension_N) {
  const auto holds = [&](double tilt) {
    const Tensions t = tensions(mechanism, platform_pose(workspace.center, workspace.radius_m, workspace.theta(azimuth),
                                                         workspace.phi(step), 0, tilt));
    return is_balanced(t.balance) && t.tension_N.minCoeff() >= least_tension_N;
  };
  if (!holds(0)) return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  int low = 0, high = 0;
  while (low > -90 && holds((low - 1) * kDegree)) --low;
  while (high < 90 && holds((high + 1) * kDegree)) ++high;
  return {low * kDegree, high * kDegree};
}

}  // namespace lumihull::capture
