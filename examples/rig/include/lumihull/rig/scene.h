#pragma once

#include <lumihull/rig/flat_print.h>
#include <lumihull/rig/object.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lumihull::rig {

/// A lamp with the shape of a sphere, fixed to the room.
struct Lamp {
  Eigen::Vector3f position{0, 0, 3};   ///< m
  float radius = .15f;                 ///< m; softens shadows and highlights
  Eigen::Vector3f intensity{1, 1, 1};  ///< a white surface at distance d, facing it, has radiance intensity / d²
};

/// The room around the object: a prism of painted panels (paper, section 3.2: "many shades of green"), a painted floor,
/// and a white ceiling that glows and that no photograph should see.
struct Enclosure {
  int panels = 8;                             ///< >= 3
  float radius = 3;                           ///< m, axis to panel
  float height = 3.3f;                        ///< m
  Eigen::Vector3f color{.030f, .20f, .042f};  ///< mean paint, linear
  float unevenness = .22f;                    ///< spread of shade among panels and within one, 0 … 1; 0: no seams
  Eigen::Vector3f ceiling{1.f, .99f, .96f};   ///< radiance
  Eigen::Vector3f glow{0, 0, 0};              ///< radiance of panels, floor and pedestal themselves: a light tent
  float pedestal_radius = 0, pedestal_height = 0;  ///< m; 0: none. Round, painted like the rest
  std::uint64_t seed = 1;                          ///< of the paint
};

inline const Eigen::Vector3f kGreenPaint{.030f, .20f, .042f};
inline const Eigen::Vector3f kBluePaint{.022f, .055f, .27f};

/// Everything that light falls on. Objects stand where their meshes are.
struct Scene {
  std::vector<Object> objects;
  Enclosure enclosure;
  std::vector<Lamp> lamps;
  /// Printed sheets that lie on walls and floor, lit as the paint there; objects and the pedestal stand before them.
  std::vector<FlatPrint> sheets;

  /// Centre and radius of a ball around all objects; (0,0,0) and 0 without objects.
  Eigen::Vector3f center() const;
  float radius() const;
  /// The same room without the objects.
  Scene emptied() const;
};

/// An object in a room made to its measure: radius ten times the object's (3 m for an object of 0.6 m), three lamps
/// under the ceiling. With a pedestal the object is lifted on it.
Scene make_scene(Object object, const Eigen::Vector3f& paint, bool pedestal, std::uint64_t seed);

}  // namespace lumihull::rig
