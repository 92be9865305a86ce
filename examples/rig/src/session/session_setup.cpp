// Everything about a virtual session that is decided before its first photograph.

#include <lumihull/base/error.h>
#include <lumihull/rig/simulate.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "light/room.h"
#include "light/scattering.h"
#include "objects/noise.h"
#include "session_plan.h"

namespace lumihull::rig {

using Eigen::Vector3d;

namespace {

constexpr double kRoomRadius_m = 3, kLeastHeight_m = 2.6, kGreatestHeight_m = 6;

/// How high up the panels the views look; infinity where one looks over any height.
double highest_seen(const std::vector<View>& views, double room_radius) {
  Enclosure high;
  high.radius = float(room_radius), high.height = 1000;
  const Room room(high);
  double top = 0;
  for (const View& view : views)
    for (int i = 0; i <= 8; ++i)
      for (const auto& [x, y] :
           {std::pair(i / 8., 0.), std::pair(i / 8., 1.), std::pair(0., i / 8.), std::pair(1., i / 8.)}) {
        const auto ray = view.camera.ray({x * view.camera.width, y * view.camera.height});
        if (!ray) continue;
        const Eigen::Vector3f way = (view.cam_from_world.rotation.conjugate() * *ray).cast<float>();
        if (way.z() <= 0) continue;
        top = std::max(top, double(room.hit(view.center().cast<float>(), way).point.z()));
      }
  return top;
}

/// Whether a view cuts the objects off at its border, or has part of them behind it.
bool cuts(const View& view, const Scene& scene) {
  constexpr std::size_t kStep = 5;  // meshes are fine
  for (const Object& object : scene.objects)
    for (std::size_t i = 0; i < object.mesh.vertices.size(); i += kStep) {
      const auto px = view.project(object.mesh.vertices[i].cast<double>());
      if (!px || !view.camera.contains(*px)) return true;
    }
  return false;
}

std::string in_words(const SimulateOptions& o, const RigSession& s) {
  const auto [low, high] = bounding_box(s.scene.objects.front().mesh);
  const Eigen::Vector3f size = high - low;
  char text[240];
  std::snprintf(text, sizeof text, " of %.2f x %.2f x %.2f m, photographed from %.2f m in a room of %.2f m radius; ",
                size.x(), size.y(), size.z(), s.radius_m, s.scene.enclosure.radius);
  std::string said = std::filesystem::path(o.object).filename().string() + text;
  if (s.targets.placed.empty()) return said + "no sheets of targets";
  return said + std::to_string(s.targets.placed.size()) + " sheets of targets, each view decodes at least " +
         std::to_string(s.least_targets);
}

}  // namespace

void check(const SimulateOptions& o) {
  const auto expect = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::invalid_argument, what, "simulate");
  };
  expect(o.photos >= 1 && o.photos <= 100'000, "photos must be from 1 to 100000");
  expect(o.empty_photos >= 0 && o.empty_photos <= 100'000, "empty photos must be from 0 to 100000");
  expect(o.lens_photos >= 0 && o.lens_photos <= 1000, "lens photos must be from 0 to 1000");
  expect(o.test_views >= 0 && o.test_views <= 100'000, "test views must be from 0 to 100000");
  expect(o.width >= 16 && o.width <= 20'000, "width must be from 16 to 20000 px");
  expect(o.size_m == 0 || (o.size_m > 1e-3 && o.size_m < 1e3), "size must be from 0.001 to 1000 m");
  expect(o.focal_mm >= 1 && o.focal_mm <= 1000, "the focal length must be from 1 to 1000 mm");
  expect(o.distortion >= 0 && o.distortion <= 1, "distortion must be from 0 to 1");
  expect(o.jpeg_quality >= 1 && o.jpeg_quality <= 100, "JPEG quality must be from 1 to 100");
  expect(o.room_radius_m == 0 || (o.room_radius_m > .05 && o.room_radius_m < 1000),
         "the room's radius must be from 0.05 to 1000 m");
  expect(o.radius_m == 0 || (o.radius_m > .01 && o.radius_m < 500), "the radius must be from 0.01 to 500 m");
  expect(o.density > 0 && o.density <= .4, "the sheets' density must be above 0, at most 0.4");
  expect(o.circle_px == 0 || (o.circle_px >= 1 && o.circle_px <= 1000), "circles must be from 1 to 1000 px");
  expect(o.least_targets >= 0 && o.least_targets <= 1000, "least targets must be from 0 to 1000");
  expect(o.phi_from_rad >= 0 && o.phi_from_rad <= o.phi_to_rad && o.phi_to_rad < 3.2,
         "polar angles must ascend, from 0 to pi");
  PhotoOptions photo = o.photo;
  photo.depth = o.depth;
  check(photo);
}

RobotErrors errors_of(const SimulateOptions& o, const capture::Plan& plan) {
  const bool exact = !plan.mechanism && (o.carrier == Carrier::ideal || o.carrier == Carrier::automatic);
  RobotErrors errors = exact ? RobotErrors::none() : o.errors;
  errors.seed = mix(o.seed, 6);
  return errors;
}

RigCamera::Options camera_of(const SimulateOptions& o, const RigSession& session, const std::string& name,
                             const std::filesystem::path& truth) {
  RigCamera::Options camera;
  camera.name = name;
  camera.lens = session.lens;
  camera.truth = truth;
  camera.depth = o.depth;
  camera.cables = o.cables;
  camera.world_from_plan = session.world_from_plan;
  camera.center = session.center;
  camera.seed = o.seed;
  return camera;
}

RigSession plan_session(const SimulateOptions& o, const std::optional<capture::Plan>& stored, Job& job) {
  check(o);
  RigSession s;
  s.lens.focal_mm = o.focal_mm;
  s.lens.jpeg_quality = o.jpeg_quality;
  s.lens.photo = o.photo;
  s.lens.camera = sensor_camera(o.width, o.focal_mm, kSensorWidth_mm, o.distortion);
  Object object = session_object(o);
  const capture::ObjectSize size = size_of(object.mesh);
  // What the paper's mechanism has as the height of its views' centre, if the object is not taller.
  const double height = std::max(1., .5 * size.height_m + .02);
  if (stored || o.plan) {
    s.plan = stored ? *stored : *o.plan;
  } else {
    MadePlan made = make_plan(o, size, height, job);
    s.plan = std::move(made.plan);
    s.notes = std::move(made.notes);
  }
  const ViewSphere sphere = sphere_of(s.plan);
  s.center = sphere.center, s.radius_m = sphere.radius_m;
  // The floor: the mechanism's room has one; else it is below the centre.
  const double floor = s.plan.mechanism ? s.plan.mechanism->room.min().z() : s.center.z() - height;
  s.world_from_plan.translation = Vector3d(-s.center.x(), -s.center.y(), -floor);

  s.errors = errors_of(o, s.plan);
  const RigRobot robot(s.plan, {s.errors, {}, false});
  std::vector<View> views;  // as commanded, and where the robot will be
  for (const capture::PlannedStop& stop : s.plan.stops)
    if (stop.photograph)
      for (const Pose& pose : {stop.cam_from_world, robot.foreseen(stop).cam_from_world})
        views.push_back({s.lens.camera, pose * s.world_from_plan.inverse()});

  StudioOptions studio;
  double out = 0, top = 0;
  for (const View& view : views)
    out = std::max(out, view.center().head<2>().norm()), top = std::max(top, view.center().z());
  studio.radius_m = o.room_radius_m > 0 ? o.room_radius_m : std::max(kRoomRadius_m, out + .3);
  const double seen = highest_seen(views, studio.radius_m);
  studio.height_m = std::max({kLeastHeight_m, std::min(seen + .15, kGreatestHeight_m), top + .3,
                              s.center.z() - floor + .5 * size.height_m + .5});
  if (seen > studio.height_m) s.notes.push_back("some photographs look over the panels");
  studio.center_height_m = (s.world_from_plan * s.center).z();
  studio.paint = o.blue ? kBluePaint : kGreenPaint;
  studio.seed = o.seed;
  s.scene = make_studio(std::move(object), studio);
  for (const View& view : views)
    if (!Room(s.scene.enclosure).contains(view.center().cast<float>()))
      throw Error(ErrorCode::invalid_argument, "the camera would leave the room, or stand in the pedestal", "simulate");

  std::size_t cut = 0;  // where the robot will be, the second of each pair of views
  for (std::size_t i = 1; i < views.size(); i += 2) cut += cuts(views[i], s.scene);
  if (cut > 0)
    s.notes.push_back(std::to_string(cut) + " of " + std::to_string(views.size() / 2) +
                      " photographs cut the object off at their border: a plan with a larger radius leaves more room");

  if (o.sheets) {
    const double circles = o.circle_px > 0 ? o.circle_px : 9;
    s.targets = scatter_targets(s.scene, s.lens.camera, s.radius_m,
                                {.circle_px = circles, .density = o.density, .seed = mix(o.seed, 5)});
    const TargetSights sights(s.scene);
    const auto poor = add_sheets(s.targets, views, o.least_targets, sights, mix(o.seed, 7));
    expect_hung(s.targets, circles);
    if (!poor.empty())
      s.notes.push_back(std::to_string(poor.size()) + " of " + std::to_string(views.size()) +
                        " views decode fewer than " + std::to_string(o.least_targets) +
                        " targets, and no free place for more was found");
    s.least_targets = INT_MAX;
    for (const View& view : views)
      s.least_targets = std::min(s.least_targets, int(sights.decodable(view, s.targets).size()));
    s.scene.sheets = s.targets.prints;
  }
  s.said = in_words(o, s);
  return s;
}

}  // namespace lumihull::rig
