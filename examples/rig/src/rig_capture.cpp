#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/rig/exif.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/rig/trajectory.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "noise.h"

namespace lumihull::rig {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

/// Everything that is decided before the first photograph is taken.
struct Session {
  Scene scene;
  Camera camera;
  std::vector<Pose> shots, empty_shots;
};

Session plan(const RigOptions& o) {
  const auto fail = [](const char* what) { throw Error(ErrorCode::invalid_argument, what, "rig"); };
  if (o.photos < 1 || o.photos > 100'000) fail("photos must be from 1 to 100000");
  if (o.empty_photos < 0 || o.empty_photos > 100'000) fail("empty photos must be from 0 to 100000");
  if (o.width < 16 || o.width > 20'000) fail("width must be from 16 to 20000 px");
  if (!(o.fill > .05 && o.fill <= 1)) fail("fill must be above 0.05, at most 1");
  if (o.jpeg_quality < 1 || o.jpeg_quality > 100) fail("JPEG quality must be from 1 to 100");
  if (!(o.size_m > 1e-3 && o.size_m < 1e3)) fail("size must be from 0.001 to 1000 m");

  Session session;
  session.scene = make_scene(object_by_name(o.object, o.size_m), o.blue ? kBluePaint : kGreenPaint, o.pedestal, o.seed);
  session.camera = default_camera(o.width, o.distortion);
  Hemisphere around;
  around.target = session.scene.center().cast<double>();
  around.radius = framing_distance(session.camera, session.scene.radius(), o.fill);
  around.seed = mix(o.seed, 1);
  const auto poses = [&](int n) {
    if (n == 0) return std::vector<Pose>();
    if (o.path == Path::ring) {
      Hemisphere ring = around;
      ring.phi_last = 1.2;
      return ring_trajectory(n, ring);
    }
    return o.path == Path::random ? random_trajectory(n, around) : hemisphere_trajectory(n, around);
  };
  session.shots = poses(o.photos);
  around.seed = mix(o.seed, 2);
  session.empty_shots = poses(o.empty_photos);
  return session;
}

std::string name_of(const char* prefix, std::size_t i) {
  char name[32];
  std::snprintf(name, sizeof name, "%s%04zu", prefix, i + 1);
  return name;
}

/// The robot takes a picture every ten seconds, beginning on a fixed morning: the clock is part of the truth, not of
/// today.
std::string clock(std::size_t shot) {
  const std::size_t s = 9 * 3600 + 10 * shot, day = s / 86400;
  char text[32];
  std::snprintf(text, sizeof text, "2007:08:%02zu %02zu:%02zu:%02zu", 1 + day % 28, s / 3600 % 24, s / 60 % 60, s % 60);
  return text;
}

Json numbers(const Eigen::Vector3f& v) { return Json::array({v.x(), v.y(), v.z()}); }

void write_truth(const fs::path& folder, const Session& session, const std::vector<std::string>& names) {
  Json json;
  json["format"] = "lumihull-rig-truth";
  json["version"] = 1;
  json["unit"] = "m";
  const Camera& c = session.camera;
  json["camera"] = {{"width", c.width}, {"height", c.height}, {"f", c.f},   {"s", c.s},
                    {"skew", c.skew},   {"u0", c.u0},         {"v0", c.v0}, {"k1", c.k1},
                    {"k2", c.k2},       {"k3", c.k3},         {"p1", c.p1}, {"p2", c.p2}};
  json["object"] = {{"name", session.scene.objects[0].name}};
  const auto [low, high] = bounding_box(session.scene.objects[0].mesh);
  json["object"]["low"] = numbers(low);
  json["object"]["high"] = numbers(high);
  json["lamps"] = Json::array();
  for (const Lamp& lamp : session.scene.lamps)
    json["lamps"].push_back(
        {{"position", numbers(lamp.position)}, {"radius", lamp.radius}, {"intensity", numbers(lamp.intensity)}});
  json["views"] = Json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto m = session.shots[i].matrix();
    Json rows = Json::array();
    for (int r = 0; r < 3; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    json["views"].push_back({{"name", names[i]}, {"cam_from_world", rows}});
  }
  write_file(folder / "cameras.json", json.dump(1) + "\n");
  hull::write_mesh(folder / "mesh.ply", session.scene.objects[0].mesh);
}

/// Takes all photographs of one kind; truth masks where `masks` names a folder.
std::vector<std::string> take(const Session& session, const Scene& scene, const std::vector<Pose>& shots,
                              const RigOptions& o, const fs::path& folder, const char* prefix, const fs::path& masks,
                              std::uint64_t seed, Job& job) {
  std::vector<std::string> files(shots.size());
  if (shots.empty()) return files;
  const Photographer photographer(scene, o.light, job);
  job.begin(masks.empty() ? "photographs of the empty enclosure" : "photographs", shots.size());
  parallel_for(
      job, shots.size(),
      [&](std::size_t i) {
        Job alone({}, 1);  // one photograph a thread: encoding is serial, so this keeps all cores busy
        const Photo photo = photographer.photograph({session.camera, shots[i]}, o.photo, mix(seed, i), alone);
        const std::string name = name_of(prefix, i);
        if (o.format == PhotoFormat::png) {
          files[i] = name + ".png";
          write_png(folder / files[i], photo.picture);
        } else {
          files[i] = name + ".jpg";
          ExifTags tags;
          tags.time = clock(i);
          tags.focal_length_mm = kFocalLength_mm;
          tags.sensor_width_mm = kSensorWidth_mm;
          tags.width = session.camera.width;
          tags.height = session.camera.height;
          write_file(folder / files[i], with_exif(encode_jpeg(photo.picture, o.jpeg_quality), tags));
        }
        if (!masks.empty() && o.truth_masks) write_file(masks / (name + ".png"), encode_mask(photo.mask));
      },
      true);
  job.end();
  return files;
}

struct Taken {
  Session session;
  std::vector<std::string> names, files, empty_files;  ///< files within photos/ and enclosure/
};

Taken take_all(const fs::path& folder, const RigOptions& o, Job& job) {
  Taken taken;
  taken.session = plan(o);
  const Session& s = taken.session;
  for (const char* sub : {"photos", "enclosure", "truth/masks"}) fs::create_directories(folder / sub);
  taken.empty_files =
      take(s, s.scene.emptied(), s.empty_shots, o, folder / "enclosure", "empty_", {}, mix(o.seed, 4), job);
  taken.files = take(s, s.scene, s.shots, o, folder / "photos", "", folder / "truth" / "masks", mix(o.seed, 3), job);
  for (std::size_t i = 0; i < taken.files.size(); ++i) taken.names.push_back(name_of("", i));
  write_truth(folder / "truth", s, taken.names);
  return taken;
}

}  // namespace

Capture make_capture(const fs::path& folder, const RigOptions& options, Job& job) {
  Capture capture = Capture::create(folder);
  const Taken taken = take_all(folder, options, job);
  capture.unit = Unit::metres;
  capture.cameras = {taken.session.camera};
  capture.background_rgb = {255, 255, 255};
  for (std::size_t i = 0; i < taken.files.size(); ++i) {
    Shot shot;
    shot.name = taken.names[i];
    shot.file = "photos/" + taken.files[i];
    shot.cam_from_world = taken.session.shots[i];
    if (options.format == PhotoFormat::jpeg) shot.time = read_image_info(folder / shot.file).time;
    capture.shots.push_back(std::move(shot));
  }
  for (std::size_t i = 0; i < taken.empty_files.size(); ++i) {
    Shot shot;
    shot.name = name_of("empty_", i);
    shot.file = "enclosure/" + taken.empty_files[i];
    capture.enclosure.push_back(std::move(shot));
  }
  capture.notes.push_back("photographs by the virtual rig; the truth is in truth/");
  capture.refresh_stamps(job);
  capture.save();
  return capture;
}

void make_photographs(const fs::path& folder, const RigOptions& options, Job& job) {
  if (options.distortion)
    throw Error(ErrorCode::invalid_argument, "projection matrices need a lens without distortion", "rig");
  if (fs::exists(folder) && !fs::is_empty(folder))
    throw Error(ErrorCode::invalid_argument, "expected a folder that is new or empty", folder.string());
  const Taken taken = take_all(folder, options, job);
  std::string listing;
  for (std::size_t i = 0; i < taken.files.size(); ++i) {
    const Eigen::Matrix<double, 3, 4> p = taken.session.camera.matrix() * taken.session.shots[i].matrix();
    listing += "photos/" + taken.files[i];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        char number[32];
        std::snprintf(number, sizeof number, " %.17g", p(r, c));
        listing += number;
      }
    listing += '\n';
  }
  write_file(folder / "P.txt", listing);
}

}  // namespace lumihull::rig
