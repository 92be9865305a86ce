#pragma once

#include <lumihull/base/job.h>
#include <lumihull/capture/workspace.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace lumihull::capture {

/// What a practical design is asked for at every pose, beyond balance and no crossing. Ask for a little more than is
/// needed: between the poses that are looked at it may be less.
struct DesignGoals {
  double least_tension_N = 2, greatest_tension_N = 120;
  double clearance_m = 0.06;       ///< the least of all that `clearance` measures
  double sight_rad = 0;            ///< between cables and the cone in which the camera sees the object
  double rotation_rad_per_m = 12;  ///< Sensitivity::rotation_joint; 12 is 0.7 degrees for 1 mm in all cables together
};

struct DesignOptions {
  std::vector<Workspace> workspaces{Workspace{}};  ///< all are served; at least one
  std::optional<KeepOut> object;
  /// Without goals the objective is the paper's Φ alone (eq. 1), which is known to lead to mechanisms of no use.
  std::optional<DesignGoals> goals = DesignGoals{};
  /// false: each cable has an attachment point of its own; true: cables 1 and 2, 3 and 4, … share one, as the paper's.
  bool paired = true;
  double largest_attachment_radius_m = 0.25;  ///< all attachments lie on one circle about the platform's z axis
  double lowest_departure_m = 0;              ///< above the floor; on any wall
  std::uint64_t seed = 1;
  std::size_t evaluations = 20000;
};

struct MechanismDesign {
  Mechanism mechanism;  ///< departures and attachments to a tenth of a millimetre
  /// What was minimised, at the mechanism as given: Φ summed over the workspaces; with goals the mean shortfall of a
  /// pose, 0 where all goals are met everywhere, >= 1 for a pose that is not balanced.
  double objective = 0;
  std::size_t evaluations = 0;
  int restarts = 0;
};

/// Departure points on the walls of base.room and attachment points on a circle, for as many cables as `base` has
/// (even, where paired); all else is the base's (paper, 2.1). Global search by CMA-ES with restarts; depends on the
/// seed, not on the number of threads. Errors: invalid_argument (options or base out of range), cancelled.
LUMIHULL_API MechanismDesign design_mechanism(const Mechanism& base, const DesignOptions& options, Job& job);

/// A found design for the paper's largest radius (table 1: 2.7 m), in a room of 16 x 18 x 10 m, the object's centre 1 m
/// above the floor: 240 views at the paper's tilt are controlled, with at least 1 N, 15 cm between cables and an object
/// of 1.5 m radius and 4 cm between cables (src/design/README.md).
LUMIHULL_API Mechanism large_mechanism();

}  // namespace lumihull::capture
