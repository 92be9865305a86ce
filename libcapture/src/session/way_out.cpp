#include "way_out.h"

#include <lumihull/base/error.h>
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/planner.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::capture::internal {

namespace {

constexpr double kAbove_m = 0.1;  ///< between the object's top and the platform's sphere
constexpr double kStep_m = 0.05, kStep_rad = 3 * std::numbers::pi / 180;
constexpr double kSamePlace_m = 0.005;

Pose between(const Pose& from, const Pose& to, double at) {
  return {from.rotation.slerp(at, to.rotation).normalized(), (1 - at) * from.translation + at * to.translation};
}

PlannedStop passing(const Plan& plan, const Pose& pose, const PlannedStop& to) {
  PlannedStop stop = to;
  stop.name = "above";
  stop.photograph = false;
  stop.world_from_platform = pose;
  const CableVector lengths = cable_lengths(*plan.mechanism, pose);
  stop.lengths_m.assign(lengths.begin(), lengths.end());
  return stop;
}

}  // namespace

std::optional<std::string> obstacle_at(const Plan& plan, const Pose& pose) {
  const KeepOut* object = plan.object ? &*plan.object : nullptr;
  // The planner kept distances; here nothing may touch.
  const PoseJudgement judged = judge_pose(*plan.mechanism, pose, object, {.clearance_m = 0, .cable_clearance_m = 0});
  for (const Obstacle& obstacle : judged.obstacles) return obstacle.text;
  return std::nullopt;
}

std::optional<std::string> obstacle_between(const Plan& plan, const Pose& from, const Pose& to) {
  if (const auto crossing = first_crossing(*plan.mechanism, from, to))
    return "cables " + plan.mechanism->cables[std::size_t(crossing->first)].name + " and " +
           plan.mechanism->cables[std::size_t(crossing->second)].name + " would cross";
  const double length = (to.translation - from.translation).norm(), angle = from.rotation.angularDistance(to.rotation);
  const int steps = std::max(1, int(std::ceil(std::max(length / kStep_m, angle / kStep_rad))));
  for (int i = 1; i < steps; ++i)
    if (auto obstacle = obstacle_at(plan, between(from, to, double(i) / steps))) return obstacle;
  return std::nullopt;
}

std::vector<PlannedStop> way_out(const Plan& plan, const Pose& from, const PlannedStop& to) {
  if (!plan.mechanism || ((from.translation - to.world_from_platform.translation).norm() < 1e-6 &&
                          from.rotation.angularDistance(to.world_from_platform.rotation) < 1e-6))
    return {to};
  const Mechanism& mechanism = *plan.mechanism;
  std::vector<Pose> poses{from};
  if (plan.object) {
    const KeepOut& object = *plan.object;
    const double top = object.base.z() + object.height_m + object.radius_m + mechanism.platform_radius_m + kAbove_m;
    const double ceiling = mechanism.room.max().z() - mechanism.platform_radius_m;
    const double z = std::min(std::max({top, from.translation.z(), to.world_from_platform.translation.z()}),
                              std::max(ceiling, from.translation.z()));
    Pose up = from, over = to.world_from_platform;
    up.translation.z() = z;
    over.translation.z() = z;
    if (z > from.translation.z() + 1e-6) poses.push_back(up);
    if ((over.translation - to.world_from_platform.translation).norm() > 1e-6) poses.push_back(over);
  }
  poses.push_back(to.world_from_platform);
  std::vector<PlannedStop> way;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    auto obstacle = obstacle_between(plan, poses[i - 1], poses[i]);
    if (!obstacle && i + 1 < poses.size()) obstacle = obstacle_at(plan, poses[i]);
    if (obstacle)
      throw Error(ErrorCode::degenerate, "no safe way straight up, over and down (" + *obstacle + ")", to.name);
    way.push_back(i + 1 < poses.size() ? passing(plan, poses[i], to) : to);
  }
  return way;
}

std::optional<Pose> pose_between(const Plan& plan, std::size_t from, std::size_t to,
                                 const std::vector<double>& lengths_m) {
  if (lengths_m.size() != plan.mechanism->cables.size()) return std::nullopt;
  const Pose start = between(plan.stops[from].world_from_platform, plan.stops[to].world_from_platform, 0.5);
  try {
    const Hanging hanging = hang_rigid(*plan.mechanism, lengths_m, start);
    // Cables that sag leave open where the platform really is.
    return hanging.taut ? std::optional(hanging.world_from_platform) : std::nullopt;
  } catch (const Error& e) {
    if (e.code() != ErrorCode::degenerate && e.code() != ErrorCode::invalid_argument) throw;
    return std::nullopt;
  }
}

std::optional<std::size_t> stop_of_lengths(const Plan& plan, const std::vector<double>& lengths_m) {
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    const auto& planned = plan.stops[i].lengths_m;
    if (planned.empty() || planned.size() != lengths_m.size()) continue;
    bool same = true;
    for (std::size_t k = 0; k < planned.size(); ++k) same &= std::abs(planned[k] - lengths_m[k]) <= kSamePlace_m;
    if (same) return i;
  }
  return std::nullopt;
}

}  // namespace lumihull::capture::internal
