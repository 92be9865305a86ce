#pragma once

#include <lumihull/capture/planner.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// What a plan's photographs will show and what it asks of the mechanism.
struct PlanReport {
  std::size_t photographs = 0;  ///< stops where photographs are taken
  double total_s = 0, travel_s = 0, settle_s = 0, exposure_s = 0;

  std::vector<std::string> cut_off;  ///< stops whose picture doesn't hold the whole object
  double least_margin_px = 0;        ///< of the object's outline to the border; -infinity: behind the camera
  double median_fill = 0;            ///< of the picture by the object, along its tighter direction

  std::vector<std::string>
      few_targets;  ///< stops that see fewer than five (README: what the pose of a photograph needs)
  int least_targets = -1, median_targets = -1;  ///< -1: no targets were given

  double least_tension_N = 0, greatest_tension_N = 0;  ///< over all stops; 0 without a mechanism
  double least_clearance_m = 0;

  std::vector<std::string> cables_in_picture;  ///< stops in whose picture a cable may be seen
  /// false: not known, for a corner of the picture lies beyond the lens model's domain.
  bool cables_known = true;
};

constexpr int kLeastTargets = 5;

/// Errors: bad_input (the plan), invalid_argument (camera, object).
LUMIHULL_API PlanReport report(const Plan& plan, const Camera& camera, const ObjectSize& object,
                               const Eigen::Vector3d& center, std::span<const PlacedTarget> targets = {});

/// Stops of a plan that its mechanism can't take, and straight ways between them that it can't go: obstacles that
/// `judge_pose` and the planner would find, in words. Empty where all is well, and without a mechanism.
LUMIHULL_API std::vector<std::string> plan_problems(const Plan& plan, const PoseLimits& limits = {});

/// Figures, what was left out and why, notes, and `plan_problems`, as one JSON object.
LUMIHULL_API std::string describe_json(const PlannedTour& tour, const PoseLimits& limits = {});

/// Pictures of a plan as SVG files of their own. From above and from the side the path with its stops, by time from
/// dark to light, cables' departures, object and room; the cables' tensions along the plan; when it is where.
LUMIHULL_API std::string plan_from_above_svg(const Plan& plan);
LUMIHULL_API std::string plan_from_side_svg(const Plan& plan);
LUMIHULL_API std::string plan_tensions_svg(const Plan& plan);  ///< Error{invalid_argument} without a mechanism
LUMIHULL_API std::string plan_time_svg(const Plan& plan);

}  // namespace lumihull::capture
