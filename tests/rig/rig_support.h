#pragma once

#include <lumihull/rig/photographer.h>
#include <lumihull/rig/trajectory.h>

#include <cstring>
#include <utility>

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

/// An object in a black room under one small lamp, painted black, with gloss: all that a photograph shows is the
/// highlight.
inline rig::Scene in_the_dark(rig::Object object, double roughness) {
  object.material.pattern = rig::Pattern::plain;
  object.material.colors[0] = {0, 0, 0};
  object.material.grain = 0;
  object.material.reflectance = .5f;
  object.material.roughness = float(roughness);
  rig::Scene scene = rig::make_scene(std::move(object), {0, 0, 0}, false, 1);
  scene.enclosure.ceiling = {0, 0, 0};
  scene.lamps.resize(1);
  scene.lamps[0].radius = .02f;
  scene.lamps[0].intensity *= .1f;
  return scene;
}

/// Where a sphere mirrors the lamp to the eye: there the normal halves the angle between both (Alhazen's problem), by
/// fixed-point iteration, which contracts for points well outside the sphere.
inline Eigen::Vector3d sphere_mirror_point(const Eigen::Vector3d& center, double radius, const Eigen::Vector3d& lamp,
                                           const Eigen::Vector3d& eye) {
  Eigen::Vector3d p = center + radius * ((lamp - center).normalized() + (eye - center).normalized()).normalized();
  for (int i = 0; i < 200; ++i) p = center + radius * ((lamp - p).normalized() + (eye - p).normalized()).normalized();
  return p;
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
