#pragma once

#include <lumihull/capture/mechanism.h>

#include <array>
#include <vector>

namespace lumihull::capture {

/// A motion from rest to rest over a distance with bounded speed, acceleration and jerk: at most seven pieces of
/// constant jerk (+ 0 -, 0, - 0 +). The shortest such motion for the limits.
struct LUMIHULL_API MotionProfile {
  double distance = 0;
  double jerk = 0;
  double jerk_s = 0, ramp_s = 0,
         cruise_s = 0;  ///< durations: of each of the four jerks, of constant acceleration (two), of constant speed

  double duration_s() const { return 4 * jerk_s + 2 * ramp_s + cruise_s; }
  /// Distance, speed, acceleration at a time; before 0 and after the end the ends' values.
  std::array<double, 3> at(double t_s) const;
  /// The same way in `factor` times the time: speed / factor, acceleration / factor², jerk / factor³.
  MotionProfile slower(double factor) const;
};

/// Error{invalid_argument} where the distance is negative or a limit is not positive.
LUMIHULL_API MotionProfile rest_to_rest(double distance, double speed, double acceleration, double jerk);

/// One move of a platform: along the straight line, about the shortest rotation, both in step with one profile, so that
/// all cables start and stop together.
///
/// The profile's distance is |dp| + platform_radius * angle: no point of the end-effector exceeds the platform's
/// limits. Where a winch would exceed its speed or acceleration, the whole move is made slower.
struct Move {
  Pose from, to;
  MotionProfile profile;
  double cable_speed_m_s = 0, cable_acceleration_m_s2 = 0;  ///< the largest of any cable

  double duration_s() const { return profile.duration_s(); }
};

/// |dp| + radius * angle of a move, m.
LUMIHULL_API double motion_distance(const Mechanism& mechanism, const Pose& from, const Pose& to);

/// A pose on the way, share 0 … 1: straight line and shortest rotation.
LUMIHULL_API Pose between(const Pose& from, const Pose& to, double share);

/// Cable speeds and accelerations are sampled at 64 times of the move and at its ends, with 1 % kept in reserve.
LUMIHULL_API Move plan_move(const Mechanism& mechanism, const Pose& from, const Pose& to);

/// The time of `plan_move` without the winches' limits: never longer, and much cheaper.
LUMIHULL_API double least_duration_s(const Mechanism& mechanism, const Pose& from, const Pose& to);

LUMIHULL_API Pose pose_at(const Move& move, double t_s);

/// What the winches are told: lengths at a time.
struct Setpoint {
  double t_s = 0;
  std::vector<double> lengths_m;
};
/// Every `period_s`, the first at 0, the last at the end of the move with the lengths of its end.
/// Error{invalid_argument}: a period that is not positive, or more than 1,000,000 setpoints.
LUMIHULL_API std::vector<Setpoint> setpoints(const Mechanism& mechanism, const Move& move, double period_s);

}  // namespace lumihull::capture
