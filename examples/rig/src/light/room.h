#pragma once

#include <lumihull/rig/scene.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace lumihull::rig {

/// Where a ray meets the room.
struct RoomHit {
  int surface = 0;  ///< 0 floor, 1 ceiling, 2 pedestal's top, 3 its side, 4 … panels
  float t = 0;
  Eigen::Vector3f point{0, 0, 0}, normal{0, 0, 1};  ///< normal towards the inside
};

/// The enclosure as a solid that rays can ask; no light yet. Convex but for the pedestal, so all is analytic.
class Room {
 public:
  static constexpr int kFloor = 0, kCeiling = 1, kPedestalTop = 2, kPedestalSide = 3, kPanels = 4;

  /// Error{invalid_argument} for a room without extent.
  explicit Room(const Enclosure& enclosure);

  const Enclosure& enclosure() const { return enclosure_; }
  int surfaces() const { return kPanels + enclosure_.panels; }
  bool contains(const Eigen::Vector3f& point) const;

  /// A point that is inside, moved by as little as `margin` (m) asks for if it is not.
  Eigen::Vector3f moved_inside(Eigen::Vector3f point, float margin) const;

  /// From a point inside; direction of any length.
  RoomHit hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  /// How much of a look around `direction` (unit length) sees the ceiling, from 0 to 1: it fades from -blur to blur,
  /// the sine of the angle to the ceiling's edge.
  float ceiling_share(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float blur) const;
  /// Like hit, but of a wall without end instead of the ceiling: there its place is its upper edge.
  RoomHit hit_below_ceiling(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  /// Whether the pedestal stands between origin and origin + direction.
  bool pedestal_between(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;

  /// The paint's linear reflectance at a place: shades of panels, clouds, brush grain, seams.
  Eigen::Vector3f paint(const RoomHit& at) const;
  /// The same without its variation within a surface: what counts for light that bounces.
  Eigen::Vector3f mean_paint(int surface) const;
  /// Normal of panel i, towards the axis.
  const Eigen::Vector3f& panel_normal(int i) const { return normals_[std::size_t(i)]; }

 private:
  void panel_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, RoomHit& out) const;
  bool pedestal_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, RoomHit& out) const;

  Enclosure enclosure_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<Eigen::Vector3f> shades_;  ///< one a surface: factor on the paint
};

}  // namespace lumihull::rig
