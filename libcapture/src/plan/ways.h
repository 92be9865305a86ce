#pragma once

// How the platform gets from one pose to another: straight, or round what is in the way.

#include <lumihull/capture/planner.h>

#include <string>
#include <vector>

namespace lumihull::capture::internal {

struct Way {
  bool open = false;
  std::vector<Pose> via;  ///< where the platform stops in between
  double length_m = 0, duration_s = 0;
  std::string why;  ///< what is in the way of the straight line, where it is not open
};

class WayFinder {
 public:
  /// All borrowed. `center`: of the views; ways round lead over spheres about it.
  WayFinder(const Mechanism& mechanism, const KeepOut* object, const Eigen::Vector3d& center, const PoseLimits& limits)
      : mechanism_(mechanism), object_(object), center_(center), limits_(limits) {}

  /// Between poses that both can be taken.
  Way find(const Pose& from, const Pose& to) const;

 private:
  bool clear(const Pose& from, const Pose& to, std::string* why) const;
  bool follow(const std::vector<Pose>& via, const Pose& from, const Pose& to, Way& best) const;

  const Mechanism& mechanism_;
  const KeepOut* object_;
  Eigen::Vector3d center_;
  PoseLimits limits_;
};

}  // namespace lumihull::capture::internal
