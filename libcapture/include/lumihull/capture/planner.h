#pragma once

#include <lumihull/base/job.h>
#include <lumihull/capture/motion.h>
#include <lumihull/capture/trajectory.h>

#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::capture {

/// What a pose must keep, beside the mechanism's own limits of lengths and tensions.
struct PoseLimits {
  double clearance_m = 0.05;         ///< of cables and platform to the object, of the platform to the room
  double cable_clearance_m = 0.005;  ///< between cables
};

/// Why a pose can't be taken, or a cable of it not used.
struct Obstacle {
  enum class Kind : std::uint8_t {
    outside_room,
    cable_long,    ///< longer than the drum holds
    cable_short,   ///< shorter than the winch may wind it
    unbalanced,    ///< no tensions hold the platform; `cable` would have to push hardest
    uncontrolled,  ///< balanced, but a motion remains that no cable resists
    slack,         ///< below its least tension
    taut,          ///< above its greatest tension
    cables_close,
    object_close,  ///< a cable or the platform
  };
  Kind kind;
  int cable = -1;    ///< index; -1: none in particular
  std::string text;  ///< one line with the numbers
};

struct PoseJudgement {
  std::vector<Obstacle> obstacles;  ///< empty: the pose can be taken
  double least_tension_N = 0, greatest_tension_N = 0;
  double clearance_m = 0;  ///< the least of all that PoseLimits asks for

  bool ok() const { return obstacles.empty(); }
};
LUMIHULL_API PoseJudgement judge_pose(const Mechanism& mechanism, const Pose& world_from_platform,
                                      const KeepOut* object, const PoseLimits& limits = {});

/// In words, the commonest first: "at 120 of 240 stops, as: cable 3 would be slack: 0.21 N, at least 1 N". Empty where
/// all are well.
LUMIHULL_API std::vector<std::string> obstacles_in_words(std::span<const PoseJudgement> judgements);

struct PlannerOptions {
  PoseLimits limits;
  std::optional<KeepOut> object;
  std::vector<std::string> cameras{"camera"};
  double turn_s = 4;                                      ///< solenoid, swing and lock, each time the camera is turned
  double release_tilt_rad = 10 * std::numbers::pi / 180;  ///< less tilt doesn't turn the camera, or turns it over
  int pictures_per_battery = 1000;                        ///< of one camera (paper, 2.3); 0: no end
  int kicks = 1000;                                       ///< attempts to leave a local optimum, for each bearing
  std::uint64_t seed = 1;
};

/// Error{invalid_argument} naming the value.
LUMIHULL_API void check(const PlannerOptions& options);

/// An order of stops and what it costs.
struct PlannedTour {
  Plan plan;                              ///< for "cables"
  double travel_m = 0, travel_s = 0;      ///< from the first stop on: of the platform's centre; of all moves
  int turns = 0;                          ///< of the camera
  int ways_round = 0;                     ///< stops that are only passed
  std::vector<std::string> left_out;      ///< names of stops that can't be taken
  std::vector<std::string> left_out_why;  ///< `obstacles_in_words` of these
  std::vector<std::string> notes;         ///< pauses, in words
};

/// Orders stops so that travelling takes as little time as can be found.
///
/// The platform moves from stop to stop along straight lines. A line is taken only if no cables cross on it and each
/// pose of it can be taken (checked every 5 cm and 3 degrees); else it goes over or round the object, and stops on the
/// way are added. With a bearing that gravity turns, stops of one bearing are taken together; before them the platform
/// goes to the lowest place of their azimuth, or to a row above it that is tilted enough, where the camera is turned.
///
/// Method: a meander over the columns, over the rows, or the nearest neighbour, whichever is shortest; then 2-opt and
/// Or-opt on neighbour lists until nothing improves; then double-bridge kicks, kept where they help. The answer depends
/// on the seed alone. Stops that can't be taken are left out.
///
/// Stops that can't be reached from the most others are left out, too: where cables would cross on each way.
///
/// Errors: invalid_argument; degenerate: not one stop can be taken, or the camera can't be turned anywhere (the message
/// says which cables and why).
LUMIHULL_API PlannedTour plan_tour(const Mechanism& mechanism, const HemisphereOptions& views,
                                   const PlannerOptions& options, Job& job);

/// The paper's order (2.2): each azimuth from the zenith to the horizon, then back up; the camera is turned at each
/// lowest place. Same ways, same checks. Azimuths don't share bearings but where `thin` leaves rows without common
/// azimuths: there each stop belongs to the equator's nearest one.
LUMIHULL_API PlannedTour raster_tour(const Mechanism& mechanism, const HemisphereOptions& views,
                                     const PlannerOptions& options, Job& job);

/// Without a mechanism: `hemisphere_views` in their order on a "turntable" or in a "hand", travel_s between neighbours.
/// Where a turntable's camera has to be moved the operator is asked to. Errors: invalid_argument, bad_input (cameras).
LUMIHULL_API PlannedTour view_tour(const std::string& robot, const HemisphereOptions& views, Orientation orientation,
                                   const std::vector<std::string>& cameras, double travel_s);

/// What must not be touched of an object that stands on the floor, or on a pedestal as wide as it is.
LUMIHULL_API KeepOut standing_object(const ObjectSize& object, const Eigen::Vector3d& center, double floor_m);

}  // namespace lumihull::capture
