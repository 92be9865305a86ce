// What is wrong with a plan, and its figures as JSON.
#include <lumihull/capture/plan_report.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "ways.h"

namespace lumihull::capture {

std::vector<std::string> plan_problems(const Plan& plan, const PoseLimits& limits) {
  constexpr std::size_t kMostNamed = 5;
  check(plan);
  if (!plan.mechanism) return {};
  const KeepOut* object = plan.object ? &*plan.object : nullptr;
  std::vector<PoseJudgement> judged;
  for (const PlannedStop& stop : plan.stops)
    judged.push_back(judge_pose(*plan.mechanism, stop.world_from_platform, object, limits));
  std::vector<std::string> out = obstacles_in_words(judged);

  // Straight lines only: the centre, for ways round, does not matter.
  const internal::WayFinder finder(*plan.mechanism, object, Eigen::Vector3d::Zero(), limits);
  std::size_t closed = 0;
  for (std::size_t i = 1; i < plan.stops.size(); ++i) {
    if (!judged[i - 1].ok() || !judged[i].ok()) continue;
    const internal::Way way = finder.straight(plan.stops[i - 1].world_from_platform, plan.stops[i].world_from_platform);
    if (!way.open && ++closed <= kMostNamed)
      out.push_back("from " + plan.stops[i - 1].name + " to " + plan.stops[i].name + ": " + way.why);
  }
  if (closed > kMostNamed) out.push_back("and " + std::to_string(closed - kMostNamed) + " more ways like these");
  return out;
}

std::string describe_json(const PlannedTour& tour, const PoseLimits& limits) {
  const Plan& plan = tour.plan;
  double travel_m = 0, travel_s = 0, settle_s = 0, exposure_s = 0;
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    const PlannedStop& stop = plan.stops[i];
    travel_s += stop.travel_s, settle_s += stop.settle_s, exposure_s += stop.exposure_s;
    if (i > 0)
      travel_m += (stop.world_from_platform.translation - plan.stops[i - 1].world_from_platform.translation).norm();
  }
  nlohmann::ordered_json json;
  json["robot"] = plan.robot;
  json["cameras"] = plan.cameras;
  json["stops"] = plan.stops.size();
  json["photographs"] = std::count_if(plan.stops.begin(), plan.stops.end(), [](const auto& s) { return s.photograph; });
  json["total_s"] = duration_s(plan);
  json["travel_s"] = travel_s;
  json["settle_s"] = settle_s;
  json["exposure_s"] = exposure_s;
  json["travel_m"] = travel_m;
  json["left_out"] = tour.left_out;
  json["left_out_why"] = tour.left_out_why;
  json["notes"] = tour.notes;
  json["problems"] = plan_problems(plan, limits);
  return json.dump();
}

}  // namespace lumihull::capture
