#pragma once

#include <lumihull/rig/photographer.h>
#include <lumihull/rig/trajectory.h>

#include <cstring>

#include "support.h"

namespace lumihull::test {

/// Light coarse enough for tests that do not look at it.
inline rig::LightOptions coarse_light() {
  rig::LightOptions light;
  light.ambient_rays = 4, light.lamp_rays = 2, light.floor_texels = 20, light.vertex_spacing = .1f;
  return light;
}

inline rig::PhotoOptions noiseless() {
  rig::PhotoOptions options;
  options.full_well = 0;
  return options;
}

/// Shot `i` of eight around a scene, object well inside the picture.
inline View view_of(const rig::Scene& scene, const Camera& camera, int i, double radius_factor = 1) {
  rig::Hemisphere around;
  around.target = scene.center().cast<double>();
  around.radius = radius_factor * rig::framing_distance(camera, scene.radius(), .7);
  around.phi_first = .5, around.phi_last = 1.35;
  return {camera, rig::random_trajectory(8, around)[std::size_t(i)]};
}

inline bool same_bytes(const Image& a, const Image& b) {
  return a.bytes() == b.bytes() && std::memcmp(a.data(), b.data(), a.bytes()) == 0;
}

}  // namespace lumihull::test
