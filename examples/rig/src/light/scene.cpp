#include <lumihull/rig/scene.h>

#include <algorithm>
#include <cmath>

#include "objects/noise.h"

namespace lumihull::rig {

using Eigen::Vector3f;

Vector3f Scene::center() const {
  Vector3f low = Vector3f::Constant(INFINITY), high = Vector3f::Constant(-INFINITY);
  for (const Object& object : objects) {
    const auto [a, b] = bounding_box(object.mesh);
    low = low.cwiseMin(a), high = high.cwiseMax(b);
  }
  return low.x() <= high.x() ? Vector3f((low + high) / 2) : Vector3f::Zero();
}

float Scene::radius() const {
  const Vector3f c = center();
  float r = 0;
  for (const Object& object : objects)
    for (const Vector3f& v : object.mesh.vertices) r = std::max(r, (v - c).norm());
  return r;
}

Scene Scene::emptied() const {
  Scene room = *this;
  room.objects.clear();
  return room;
}

Scene make_scene(Object object, const Vector3f& paint, bool pedestal, std::uint64_t seed) {
  Scene scene;
  scene.objects.push_back(std::move(object));
  const float r = scene.radius();
  Enclosure& room = scene.enclosure;
  room.color = paint;
  room.radius = 10 * r;
  room.height = 11 * r;
  room.seed = mix(seed, 0x700);
  if (pedestal) {
    float foot = 0;
    for (const Vector3f& v : scene.objects[0].mesh.vertices) foot = std::max(foot, v.head<2>().norm());
    room.pedestal_radius = scene.objects[0].stand > 0 ? scene.objects[0].stand : 1.25f * foot;
    room.pedestal_height = 1.2f * r;
    for (Vector3f& v : scene.objects[0].mesh.vertices) v.z() += room.pedestal_height;
  }
  // Light from `where` that is worth `strength` at the object: a key lamp, a fill, and one from behind.
  const Vector3f center = scene.center();
  const auto lamp = [&](float azimuth, float out, float up, float size, float strength, const Vector3f& tint) {
    Lamp l;
    l.position = Vector3f(out * r * std::cos(azimuth), out * r * std::sin(azimuth), up * r);
    l.radius = size * r;
    l.intensity = tint * strength * (l.position - center).squaredNorm();
    scene.lamps.push_back(l);
  };
  lamp(-1.05f, 7.5f, 7.2f, .70f, .76f, {1.f, .96f, .90f});
  lamp(-2.60f, 7.6f, 6.6f, 1.1f, .36f, {.92f, .97f, 1.f});
  lamp(1.15f, 7.0f, 7.8f, .80f, .46f, {1.f, .98f, .95f});
  return scene;
}

}  // namespace lumihull::rig
