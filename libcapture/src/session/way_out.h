#pragma once

// Ways that the planner has not looked at: after a restart, to a stop that is photographed once more.

#include <lumihull/capture/plan.h>

#include <optional>
#include <string>
#include <vector>

namespace lumihull::capture::internal {

/// Stops on a way that keeps out of the object: straight up above it, over to above `to`, straight down; `to` is the
/// last. Without a mechanism: `to` alone. Error{degenerate} naming what is in the way.
std::vector<PlannedStop> way_out(const Plan& plan, const Pose& from, const PlannedStop& to);

/// What is in the way of the straight line; nullopt: nothing (cables do not cross, every 5 cm and 3° are checked).
std::optional<std::string> obstacle_between(const Plan& plan, const Pose& from, const Pose& to);

/// What is wrong with a stop itself.
std::optional<std::string> obstacle_at(const Plan& plan, const Pose& pose);

/// The pose of a platform that was stopped between two stops, from its lengths; nullopt: they fit no place nearby.
std::optional<Pose> pose_between(const Plan& plan, std::size_t from, std::size_t to,
                                 const std::vector<double>& lengths_m);

/// The stop of the plan whose lengths are these (within 5 mm each); nullopt: none.
std::optional<std::size_t> stop_of_lengths(const Plan& plan, const std::vector<double>& lengths_m);

}  // namespace lumihull::capture::internal
