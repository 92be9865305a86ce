#include <lumihull/base/error.h>
#include <lumihull/rig/studio.h>

#include <algorithm>
#include <cmath>

#include "objects/noise.h"

namespace lumihull::rig {

using Eigen::Vector3f;

Scene make_studio(Object object, const StudioOptions& o) {
  if (!(o.radius_m > 0 && o.radius_m < 1000) || !(o.height_m > 0 && o.height_m < 1000) ||
      !(o.center_height_m > 0 && o.center_height_m < o.height_m))
    throw Error(ErrorCode::invalid_argument, "expected a room of positive size that holds the object", "studio");
  Scene scene;
  scene.objects.push_back(std::move(object));
  Object& thing = scene.objects[0];
  const auto [low, high] = bounding_box(thing.mesh);
  const float half = .5f * (high.z() - low.z()), lift = std::max(0.f, float(o.center_height_m) - half);
  const Vector3f shift(-.5f * (low.x() + high.x()), -.5f * (low.y() + high.y()), lift - low.z());
  float foot = 0;  // what of it stands on the pedestal
  for (Vector3f& v : thing.mesh.vertices) {
    v += shift;
    if (v.z() < lift + .1f * half) foot = std::max(foot, v.head<2>().norm());
  }
  if (high.z() - low.z() + lift >= .95f * o.height_m || foot >= .9f * o.radius_m)
    throw Error(ErrorCode::invalid_argument, "the object is too large for the room", "studio");

  Enclosure& room = scene.enclosure;
  room.color = o.paint;
  room.radius = float(o.radius_m);
  room.height = float(o.height_m);
  room.seed = mix(o.seed, 0x700);
  if (lift > .01f * half) {
    // As wide as what stands on it: what juts out would hide more of the object from below.
    room.pedestal_radius = thing.stand > 0 ? thing.stand : 1.05f * foot;
    room.pedestal_height = lift;
  }
  // Light from `where` that is worth `strength` at the object: a key lamp, a fill, and one from behind.
  const Vector3f center = scene.center();
  const auto lamp = [&](float azimuth, float out, float up, float size, float strength, const Vector3f& tint) {
    Lamp l;
    const float r = out * room.radius;
    l.position = Vector3f(r * std::cos(azimuth), r * std::sin(azimuth), up * room.height);
    l.radius = size * room.radius;
    l.intensity = tint * strength * (l.position - center).squaredNorm();
    scene.lamps.push_back(l);
  };
  lamp(-1.05f, .75f, .85f, .070f, .66f, {1.f, .96f, .90f});
  lamp(-2.60f, .76f, .80f, .110f, .31f, {.92f, .97f, 1.f});
  lamp(1.15f, .70f, .90f, .080f, .40f, {1.f, .98f, .95f});
  return scene;
}

}  // namespace lumihull::rig
