#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/rig/exif.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/rig/target_sheets.h>
#include <lumihull/rig/trajectory.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "light/scattering.h"
#include "objects/noise.h"
#include "objects/repaint.h"
#include "truth.h"

namespace lumihull::rig {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> names(const char* prefix, int n) {
  std::vector<std::string> result;
  for (int i = 0; i < n; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%s%04d", prefix, i + 1);
    result.push_back(name);
  }
  return result;
}

/// Everything that is decided before the first photograph is taken.
struct Session {
  Scene scene;
  Camera camera;
  RoomTargets targets;
  NamedShots shots, empty_shots, test_views;
};

Object object_of(const RigOptions& o) {
  return repainted(object_by_name(o.object, o.size_m), {o.matt, o.uniform, o.unlit, o.photo.exposure});
}

Session plan(const RigOptions& o) {
  const auto fail = [](const char* what) { throw Error(ErrorCode::invalid_argument, what, "rig"); };
  if (o.photos < 1 || o.photos > 100'000) fail("photos must be from 1 to 100000");
  if (o.empty_photos < 0 || o.empty_photos > 100'000) fail("empty photos must be from 0 to 100000");
  if (o.width < 16 || o.width > 20'000) fail("width must be from 16 to 20000 px");
  if (o.test_views < 0 || o.test_views > 100'000) fail("test views must be from 0 to 100000");
  if (!(o.fill > .05 && o.fill <= 1)) fail("fill must be above 0.05, at most 1");
  if (o.jpeg_quality < 1 || o.jpeg_quality > 100) fail("JPEG quality must be from 1 to 100");
  if (!(o.size_m > 1e-3 && o.size_m < 1e3)) fail("size must be from 0.001 to 1000 m");

  Session session;
  session.scene = make_scene(object_of(o), o.blue ? kBluePaint : kGreenPaint, o.pedestal, o.seed);
  session.camera = default_camera(o.width, o.distortion);
  Hemisphere around;
  around.target = session.scene.center().cast<double>();
  around.radius = framing_distance(session.camera, session.scene.radius(), o.fill);
  around.seed = mix(o.seed, 1);
  if (o.targets) {
    session.targets = scatter_targets(session.scene, session.camera, around.radius,
                                      {.circle_px = o.target_px, .seed = mix(o.seed, 5)});
    expect_hung(session.targets, o.target_px);
    session.scene.sheets = std::move(session.targets.prints);
  }
  if (o.path == Path::ring) around.phi_first = around.phi_last = 1.2;
  const auto shots = [&](int n, const char* prefix) {
    NamedShots named;
    if (n == 0) return named;
    named.cam_from_world = o.path == Path::hemisphere ? hemisphere_trajectory(n, around)
                           : o.path == Path::ring     ? ring_trajectory(n, around)
                                                      : random_trajectory(n, around);
    named.names = names(prefix, n);
    return named;
  };
  session.shots = shots(o.photos, "");
  around.seed = mix(o.seed, 2);
  session.empty_shots = shots(o.empty_photos, "empty_");
  if (o.test_views > 0) {
    // Where the brightest lamp's highlight is seen all the way.
    const Eigen::Vector3f to_lamp = session.scene.lamps[0].position - session.scene.center();
    around.jitter = 0;
    session.test_views = {names("test_", o.test_views),
                          arc_trajectory(o.test_views, around, std::atan2(to_lamp.y(), to_lamp.x()))};
  }
  return session;
}

/// The robot takes a picture every ten seconds, beginning on a fixed morning: the clock is part of the truth, not of
/// today.
std::string clock(std::size_t shot) {
  const std::size_t s = 9 * 3600 + 10 * shot, day = s / 86400;
  char text[32];
  std::snprintf(text, sizeof text, "2007:08:%02zu %02zu:%02zu:%02zu", 1 + day % 28, s / 3600 % 24, s / 60 % 60, s % 60);
  return text;
}

/// Takes all photographs of one kind, and masks where `masks` names a folder; the files' names.
std::vector<std::string> take(const Photographer& photographer, const Camera& camera, const NamedShots& shots,
                              const RigOptions& o, const char* what, const fs::path& folder, const fs::path& masks,
                              std::uint64_t seed, Job& job) {
  std::vector<std::string> files(shots.names.size());
  job.begin(what, files.size());
  parallel_for(
      job, files.size(),
      [&](std::size_t i) {
        Job alone({}, 1);  // one photograph a thread: encoding is serial, so this keeps all cores busy
        const Photo photo = photographer.photograph({camera, shots.cam_from_world[i]}, o.photo, mix(seed, i), alone);
        if (o.format == PhotoFormat::png) {
          files[i] = shots.names[i] + ".png";
          write_png(folder / files[i], photo.picture);
        } else {
          files[i] = shots.names[i] + ".jpg";
          ExifTags tags;
          tags.time = clock(i);
          tags.focal_length_mm = camera.f * o.photo.sensor_width_mm / camera.width;
          tags.sensor_width_mm = o.photo.sensor_width_mm;
          if (o.photo.f_number > 0) tags.f_number = o.photo.f_number;
          tags.width = camera.width;
          tags.height = camera.height;
          write_file(folder / files[i], with_exif(encode_jpeg(photo.picture, o.jpeg_quality), tags));
        }
        if (!masks.empty()) write_file(masks / (shots.names[i] + ".png"), encode_mask(photo.mask));
      },
      true);
  job.end();
  return files;
}

struct Taken {
  Session session;
  std::vector<std::string> files, empty_files;  ///< within photos/ and enclosure/
};

Taken take_all(const fs::path& folder, const RigOptions& o, Job& job) {
  Taken taken;
  taken.session = plan(o);
  const Session& s = taken.session;
  const fs::path truth = folder / "truth";
  for (const fs::path& sub : {folder / "photos", folder / "enclosure", truth / "masks"}) fs::create_directories(sub);
  if (o.empty_photos > 0) {
    const Photographer photographer(s.scene.emptied(), o.light, job);
    taken.empty_files = take(photographer, s.camera, s.empty_shots, o, "photographs of the empty enclosure",
                             folder / "enclosure", {}, mix(o.seed, 4), job);
  }
  const Photographer photographer(s.scene, o.light, job);
  taken.files = take(photographer, s.camera, s.shots, o, "photographs", folder / "photos",
                     o.truth_masks ? truth / "masks" : fs::path(), mix(o.seed, 3), job);
  write_camera_truth(truth / "cameras.json", s.scene, s.camera, s.shots);
  if (o.targets) write_target_truth(truth / "targets.json", s.targets.placed);
  hull::write_mesh(truth / "mesh.ply", s.scene.objects[0].mesh);
  const HighlightFinder finder(s.scene);
  if (finder.any()) write_highlights(truth / "highlights.json", finder, s.camera, s.shots, o.photo.exposure, job);
  if (o.test_views > 0) {
    RigOptions exact = o;
    exact.format = PhotoFormat::png;
    exact.photo.full_well = 0;
    exact.photo.reduce = 1;
    fs::create_directories(truth / "test_views" / "masks");
    take(photographer, s.camera, s.test_views, exact, "test views", truth / "test_views",
         truth / "test_views" / "masks", 0, job);
    write_camera_path(truth / "test_views.json", s.camera, s.test_views);
    if (finder.any()) {
      write_highlights(truth / "test_highlights.json", finder, s.camera, s.test_views, o.photo.exposure, job);
      photograph_highlights(truth / "test_views", photographer, s.camera, s.test_views, exact.photo, job);
    }
  }
  return taken;
}

}  // namespace

Capture make_capture(const fs::path& folder, const RigOptions& options, Job& job) {
  if (options.targets)
    throw Error(ErrorCode::invalid_argument, "photographs with targets are for importers: make_photographs", "rig");
  Capture capture = Capture::create(folder);
  const Taken taken = take_all(folder, options, job);
  capture.unit = Unit::metres;
  capture.cameras = {taken.session.camera};
  capture.background_rgb = {255, 255, 255};
  for (std::size_t i = 0; i < taken.files.size(); ++i) {
    Shot shot;
    shot.name = taken.session.shots.names[i];
    shot.file = "photos/" + taken.files[i];
    shot.cam_from_world = taken.session.shots.cam_from_world[i];
    if (options.format == PhotoFormat::jpeg) shot.time = read_image_info(folder / shot.file).time;
    capture.shots.push_back(std::move(shot));
  }
  for (std::size_t i = 0; i < taken.empty_files.size(); ++i) {
    Shot shot;
    shot.name = taken.session.empty_shots.names[i];
    shot.file = "enclosure/" + taken.empty_files[i];
    capture.enclosure.push_back(std::move(shot));
  }
  capture.notes.push_back("photographs by the virtual rig; the truth is in truth/");
  capture.refresh_stamps(job);
  capture.save();
  return capture;
}

void make_photographs(const fs::path& folder, const RigOptions& options, Job& job) {
  if (options.distortion && !options.targets)
    throw Error(ErrorCode::invalid_argument, "projection matrices need a lens without distortion", "rig");
  if (fs::exists(folder) && !fs::is_empty(folder))
    throw Error(ErrorCode::invalid_argument, "expected a folder that is new or empty", folder.string());
  const Taken taken = take_all(folder, options, job);
  if (options.targets) {
    taken.session.targets.set.save(folder / "sheets.json");
    return;
  }
  std::string listing;
  for (std::size_t i = 0; i < taken.files.size(); ++i) {
    const Eigen::Matrix<double, 3, 4> p =
        taken.session.camera.matrix() * taken.session.shots.cam_from_world[i].matrix();
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
