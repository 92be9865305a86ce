#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/capture/mechanism.h>

#include <optional>
#include <vector>

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
  double cable_platform = 0;  ///< cables against the end-effector's sphere; those that start inside it leave it once
                              ///< and don't count: infinite if all do
  double cable_camera = 0;    ///< cables against the platform's origin, where the camera is
  double cable_object = 0;    ///< infinite without an object
  double platform_object = 0;
  double platform_room = 0;  ///< to walls, floor, ceiling
};
/// Errors: invalid_argument (0 or more than 12 cables, a pose not finite, a negative size of the object).
LUMIHULL_API Clearance clearance(const Mechanism& mechanism, const Pose& world_from_platform,
                                 const KeepOut* object = nullptr);

/// Whether two cables pass through each other while the platform goes from one pose to the other along the straight
/// line and the shortest rotation, at a constant rate. Pairs that share a point are left out.
struct Crossing {
  int first = 0, second = 0;  ///< indices of the cables
  double at = 0;              ///< 0 … 1 of the way
};
LUMIHULL_API std::optional<Crossing> first_crossing(const Mechanism& mechanism, const Pose& from, const Pose& to);

/// A cable that runs through a camera's picture, or so near to it that distortion may bring it in.
struct CableInPicture {
  int cable = 0;                           ///< index
  Eigen::Vector3d from_m, to_m;            ///< its part before the camera, in the camera's frame
  std::optional<Eigen::Vector2d> from_px;  ///< where these ends are in the picture's plane, if the lens model tells
  std::optional<Eigen::Vector2d> to_px;
};
/// Cables against the pyramid from the camera's centre that holds every ray of the picture's border (rays are sampled;
/// for a distorted picture it is a little wider than the picture), from 1 mm before the camera on.
/// Error{degenerate} where a corner of the picture lies beyond the lens model's domain; invalid_argument.
LUMIHULL_API std::vector<CableInPicture> cables_in_picture(const Mechanism& mechanism, const Pose& world_from_platform,
                                                           const Camera& camera, const Pose& cam_from_world);

}  // namespace lumihull::capture
