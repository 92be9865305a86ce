#pragma once

#include <lumihull/capture/robot.h>

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::rig {

/// How far the virtual robot is from what its plan takes it for. Standard deviations, but where said otherwise. The
/// defaults come back to a place as the paper's robot does (fig. 9: within 6 cm and 7 degrees), and swing as it does
/// (fig. 8: less than a pixel after 7 s).
struct RobotErrors {
  // ---- cables
  double departure_m = .003;    ///< of each coordinate of a departure point, for good
  double attachment_m = .0005;  ///< of each coordinate of an attachment, for good
  double offset_m = .002;       ///< of each winch's zero, for good
  double gain = .0003;          ///< of each drum's circumference, for good
  double winch_m = .005;        ///< of each cable's length, anew at each arrival
  double common_m = .009;       ///< of all lengths together (warmth, voltage), anew at each arrival: up and down
  double mount_m = .002, mount_rad = .004;  ///< of the camera on the platform, for good
  double bearing_rad = .005;                ///< where the bearing locks, anew at each turn
  // ---- turntables and hands
  double table_m = .001, table_rad = .001;  ///< anew at each arrival
  double hand_m = .015, hand_rad = .015;
  // ---- residual swing about where it comes to rest, of cables only; amplitudes when the move ends
  double swing_m = .006, swing_rad = .002;
  double swing_period_s = 1.1;
  double swing_decay_s = 1.6;  ///< amplitudes fall to 1/e in this time

  std::uint64_t seed = 1;

  /// A robot that is where its plan says, at once.
  static RobotErrors none();
};

/// The cable-driven robot, a turntable or a hand, as a machine: it is commanded as any other, and where it really is
/// only `cam_from_world` tells. Its true pose follows from the commanded cable lengths, the winches' errors, a
/// mechanism that is not quite the plan's, and forward kinematics; then it swings.
///
/// Time is the rig's own: it passes by moving and by `pass`, and is kept in a file with all else that the controller
/// knows, so that a capture that was killed goes on with the same robot. What happens at a place depends on seed, place
/// and how often the robot has come there, not on what happened before. A move to where it is moves nothing, and takes
/// no time. Nor do ways that only a session takes which goes on after a stop (the plan's clock goes on where it was): a
/// killed capture makes the same photographs, at the same times.
class RigRobot : public capture::Robot {
 public:
  struct Options {
    RobotErrors errors;
    std::filesystem::path memory;  ///< empty: forgotten with the program
    /// Between moves and `pass`es time goes on by the clock on the wall, too: for a session that really waits.
    bool real_time = false;
  };
  /// plan: its mechanism, if any, is what the controller believes in. Errors: bad_input (memory), invalid_argument.
  RigRobot(const capture::Plan& plan, const Options& options);

  State state() override;
  void move_to(const capture::PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const capture::PlannedStop& stop) override;
  void make_safe() noexcept override {}

  /// Lets time pass: an exposure.
  void pass(double seconds);
  /// Lets time pass until then; none where it has passed.
  void pass_until(double time_s);
  /// Lets time pass until so many seconds after the last move or turn; none where they have passed.
  void settle(double seconds);
  double now_s() const;  ///< since the first session began
  const std::string& stop() const { return memory_.stop; }

  /// The true pose of the camera at a time from the last arrival on, in the plan's world.
  Pose cam_from_world(double time_s) const;
  /// The true pose once the swing has died out.
  Pose cam_from_world_at_rest() const;

  struct CableLine {
    Eigen::Vector3d departure, end;  ///< the plan's world, m
  };
  struct Standing {
    Pose cam_from_world;
    std::vector<CableLine> cables;
  };
  /// Where the robot will be, at rest, when it comes to a stop's place for the nth time; the bearing's own error is not
  /// in it.
  Standing foreseen(const capture::PlannedStop& stop, int visit = 1) const;

  /// Where the true cables are at a time; none without a mechanism.
  std::vector<CableLine> cables(double time_s) const;
  /// The true mechanism; the plan's where there are no errors.
  const std::optional<capture::Mechanism>& true_mechanism() const { return true_mechanism_; }

 private:
  /// What the controller would know after a restart, and what is true of the machine.
  struct Memory {
    std::string stop;  ///< empty: not yet anywhere
    std::vector<double> lengths_m;
    double clock_s = 0, arrived_s = 0, still_s = 0, swing = 0;
    double roll_rad = 0;
    std::string turned_at;          ///< where the bearing was last turned
    std::uint64_t place = 0;        ///< what these lengths are known by; without a mechanism the stop's name
    int visit = 0;                  ///< of the place, from 1
    int reached = -1, turned = -1;  ///< the last stops of the plan whose way, and turn of the camera, took their time
    Pose commanded;                 ///< of the platform; without a mechanism of the camera
    std::map<std::uint64_t, int> visits;
  };
  std::uint64_t place_of(const capture::PlannedStop& stop) const;
  Pose rest_of(const capture::PlannedStop& stop, int visit) const;
  Pose platform_at(double time_s) const;
  std::vector<CableLine> cables_to(const Pose& platform) const;
  Pose camera_on(const Pose& platform, double roll_rad, const std::string& turned_at) const;
  std::optional<int> index_of(const std::string& stop) const;
  void travel(const capture::PlannedStop& stop);
  void arrive(const capture::PlannedStop& stop, double swing);
  void tick();
  void remember() const;
  void recall();

  std::string kind_;
  std::vector<double> travel_s_, turn_s_;     ///< of the plan's stops
  std::map<std::string, int> index_of_stop_;  ///< in the plan
  std::optional<capture::Mechanism> mechanism_, true_mechanism_;
  Pose mount_;  ///< true camera from where the plan has it
  Options options_;
  Memory memory_;
  Pose rest_;  ///< world_from_platform at rest (without a mechanism world_from_camera)
  std::chrono::steady_clock::time_point woke_;
};

}  // namespace lumihull::rig
