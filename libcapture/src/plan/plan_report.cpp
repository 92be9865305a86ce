#include <lumihull/base/error.h>
#include <lumihull/capture/plan_report.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::capture {
namespace {

template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T(0);
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void look_for_cables(const Mechanism& mechanism, const PlannedStop& stop, const Camera& camera, PlanReport& r) {
  try {
    if (!cables_in_picture(mechanism, stop.world_from_platform, camera, stop.cam_from_world).empty())
      r.cables_in_picture.push_back(stop.name);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::degenerate) throw;
    r.cables_known = false;
    r.cables_in_picture.clear();
  }
}

}  // namespace

PlanReport report(const Plan& plan, const Camera& camera, const ObjectSize& object, const Eigen::Vector3d& center,
                  std::span<const PlacedTarget> targets) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  check(plan);
  check(object);
  camera.validate();
  PlanReport r;
  r.least_margin_px = kInfinity;
  if (plan.mechanism) r.least_tension_N = r.least_clearance_m = kInfinity;
  std::vector<double> fills;
  std::vector<int> seen;
  const KeepOut* keep_out = plan.object ? &*plan.object : nullptr;
  for (const PlannedStop& stop : plan.stops) {
    r.travel_s += stop.travel_s, r.settle_s += stop.settle_s, r.exposure_s += stop.exposure_s;
    if (plan.mechanism) {
      const PoseJudgement judged = judge_pose(*plan.mechanism, stop.world_from_platform, keep_out);
      r.least_tension_N = std::min(r.least_tension_N, judged.least_tension_N);
      r.greatest_tension_N = std::max(r.greatest_tension_N, judged.greatest_tension_N);
      r.least_clearance_m = std::min(r.least_clearance_m, judged.clearance_m);
    }
    if (!stop.photograph) continue;
    ++r.photographs;
    const View view{camera, stop.cam_from_world};
    const Framing framed = framing(view, object, center);
    r.least_margin_px = std::min(r.least_margin_px, framed.least_margin_px);
    if (!framed.whole) r.cut_off.push_back(stop.name);
    fills.push_back(framed.fill);
    if (plan.mechanism && r.cables_known) look_for_cables(*plan.mechanism, stop, camera, r);
    if (targets.empty()) continue;
    seen.push_back(targets_in_view(view, targets, object, center));
    if (seen.back() < kLeastTargets) r.few_targets.push_back(stop.name);
  }
  r.total_s = r.travel_s + r.settle_s + r.exposure_s;
  r.median_fill = median(fills);
  if (!seen.empty()) {
    r.least_targets = *std::min_element(seen.begin(), seen.end());
    r.median_targets = median(seen);
  }
  return r;
}

}  // namespace lumihull::capture
