#include "objective.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sight.h"

namespace lumihull::capture::design {
namespace {

double reflected(double x) { return std::abs(std::remainder(x, 2.0)); }
double periodic(double x) { return x - std::floor(x); }
double rounded(double metres) { return std::round(metres * 1e4) * 1e-4; }

/// A point on the walls: `along` the room's outline from 0 to 1, `up` from the lowest height to the ceiling.
Eigen::Vector3d on_wall(const Eigen::AlignedBox3d& room, double lowest, double along, double up) {
  const Eigen::Vector3d size = room.sizes(), low = room.min(), high = room.max();
  const double z = low.z() + lowest + up * (size.z() - lowest);
  double at = along * 2 * (size.x() + size.y());
  if (at < size.x()) return {low.x() + at, low.y(), z};
  at -= size.x();
  if (at < size.y()) return {high.x(), low.y() + at, z};
  at -= size.y();
  if (at < size.x()) return {high.x() - at, high.y(), z};
  return {low.x(), high.y() - (at - size.x()), z};
}

/// 0 where the value reaches the goal, 1 where it is worse by `reach` or more.
double shortfall(double value, double goal, double reach) { return std::clamp((goal - value) / reach, 0.0, 1.0); }

/// How far from balance: the most negative tension of W t = -r, in weights; large where W is singular.
double imbalance(const Mechanism& mechanism, const Pose& pose) {
  if (mechanism.cables.size() != 6)
    return tensions(mechanism, pose).residual_N / (mechanism.mass_kg * mechanism.gravity_m_s2);
  const Eigen::Matrix<double, 6, 6> w = wrench_matrix(mechanism, pose);
  Eigen::Matrix<double, 6, 1> load;
  load << 0, 0, 1, (pose.rotation * mechanism.center_of_mass).cross(Eigen::Vector3d::UnitZ());
  const double least = Eigen::PartialPivLU<Eigen::Matrix<double, 6, 6>>(w).solve(load).minCoeff();
  return std::isfinite(least) ? std::max(0.0, -least) : 1e3;
}

/// 0 … 1 for a balanced pose, 1 … 2 for others.
double pose_shortfall(const Mechanism& mechanism, const DesignOptions& options, const Workspace& workspace,
                      const Pose& pose, double theta) {
  const Balance balance = static_test(mechanism, pose);
  if (balance != Balance::controlled && balance != Balance::loose) {
    const double x = imbalance(mechanism, pose);
    return 1 + x / (1 + x);
  }
  const DesignGoals& goals = *options.goals;
  const KeepOut* object = options.object ? &*options.object : nullptr;
  const Tensions t = tensions(mechanism, pose);
  const double sight = sight_rad(mechanism, pose, theta, workspace.center, object ? object->radius_m : 0);
  // 1 / (L sigma_6) bounds the rotation; mostly that is enough to know.
  double rotation = 1 / (characteristic_length(mechanism) * t.smallest_singular);
  if (!(rotation <= goals.rotation_rad_per_m)) rotation = sensitivity(mechanism, pose).rotation_joint;
  const std::array<double, 5> terms = {
      shortfall(t.tension_N.minCoeff(), goals.least_tension_N, goals.least_tension_N),
      shortfall(-t.tension_N.maxCoeff(), -goals.greatest_tension_N, 2 * goals.greatest_tension_N),
      shortfall(least_clearance_m(clearance(mechanism, pose, object)), goals.clearance_m, goals.clearance_m),
      shortfall(sight, goals.sight_rad, goals.sight_rad + 0.1),
      shortfall(-rotation, -goals.rotation_rad_per_m, 3 * goals.rotation_rad_per_m)};
  // The worst as well as the mean: a cable that touches is not made good by tensions.
  return 0.5 * *std::max_element(terms.begin(), terms.end()) + 0.1 * std::accumulate(terms.begin(), terms.end(), 0.0);
}

double practical(const Mechanism& mechanism, const DesignOptions& options) {
  double sum = 0, poses = 0;
  for (const Workspace& w : options.workspaces) {
    for (int a = 0; a < w.azimuths; ++a)
      for (int step = 0; step < w.polar_steps; ++step) {
        const Pose pose = w.pose(a, step);
        sum += pose_shortfall(mechanism, options, w, pose, w.theta(a));
        if (step + 1 < w.polar_steps)
          sum += first_crossing(mechanism, pose, w.pose(a, step + 1)).has_value();
        else if (a + 1 < w.azimuths)
          sum += first_crossing(mechanism, pose, w.pose(a + 1, step)).has_value();
      }
    poses += double(w.size());
  }
  return sum / poses;
}

}  // namespace

int unknowns(const Mechanism& base, const DesignOptions& options) {
  const int cables = int(base.cables.size());
  return 2 * cables + (options.paired ? cables / 2 : cables) + 1;
}

Mechanism decoded(const Mechanism& base, const DesignOptions& options, const Eigen::VectorXd& x) {
  Mechanism out = base;
  const Eigen::Index cables = Eigen::Index(base.cables.size());
  const double radius = options.largest_attachment_radius_m * reflected(x[x.size() - 1]);
  for (Eigen::Index i = 0; i < cables; ++i) {
    Cable& cable = out.cables[std::size_t(i)];
    const double angle = 2 * std::numbers::pi * x[2 * cables + (options.paired ? i / 2 : i)];
    cable.departure =
        on_wall(base.room, options.lowest_departure_m, periodic(x[2 * i]), reflected(x[2 * i + 1])).unaryExpr(&rounded);
    cable.departure = cable.departure.cwiseMax(base.room.min()).cwiseMin(base.room.max());
    cable.attachment = {rounded(radius * std::cos(angle)), rounded(radius * std::sin(angle)), 0};
  }
  return out;
}

double objective(const Mechanism& mechanism, const DesignOptions& options) {
  if (options.goals) return practical(mechanism, options);
  double sum = 0;
  for (const Workspace& w : options.workspaces) sum += paper_objective(mechanism, w);
  return sum;
}

}  // namespace lumihull::capture::design
