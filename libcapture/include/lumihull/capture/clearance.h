#pragma once

#include <lumihull/capture/mechanism.h>

#include <optional>
#include <string>

namespace lumihull::capture {

/// What must not be touched: a vertical cylinder with a half-sphere's cap is enough for an object on its pedestal.
struct KeepOut {
  Eigen::Vector3d base = Eigen::Vector3d::Zero();  ///< centre of the lower end, world, m
  double radius_m = 0;
  double height_m = 0;  ///< of the cylinder, along z
};

/// Least distances at one pose, m; surfaces, not axes (radii are subtracted; negative: they intersect).
struct Clearance {
  double cable_cable = 0;     ///< pairs that share an attachment or departure point count outside 5 cm around it
  double cable_platform = 0;  ///< cables against the end-effector's sphere, beyond where they enter it
  double cable_object = 0;    ///< infinite without an object
  double platform_object = 0;
  double platform_room = 0;  ///< to walls, floor, ceiling
};
LUMIHULL_API Clearance clearance(const Mechanism& mechanism, const Pose& world_from_platform,
                                 const KeepOut* object = nullptr);

/// Whether two cables pass through each other while the platform goes from one pose to the other along the straight
/// line and the shortest rotation. Pairs that share a point are left out.
struct Crossing {
  int first = 0, second = 0;  ///< indices of the cables
  double at = 0;              ///< 0 … 1 of the way
};
LUMIHULL_API std::optional<Crossing> first_crossing(const Mechanism& mechanism, const Pose& from, const Pose& to);

}  // namespace lumihull::capture
