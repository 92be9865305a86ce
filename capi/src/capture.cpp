#include <lumihull/base/capture.h>
#include <lumihull/slf/results.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

constexpr std::size_t kMaxEntries = 100'000;  ///< cameras or shots: what a capture's files may hold

/// The shot of a capture handle, const like the handle.
template <class Handle>
auto& shot_of(Handle* capture, size_t shot) {
  auto& shots = given(capture, "capture").value.shots;
  return shots[index(shot, shots.size(), "shot")];
}

}  // namespace

lh_status lh_capture_open(lh_context* ctx, const char* folder, lh_capture** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, Capture::open(path(folder, "folder")));
  });
}

lh_status lh_capture_create(lh_context* ctx, const char* folder, lh_capture** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, Capture::create(path(folder, "folder")));
  });
}

lh_status lh_capture_save(lh_context* ctx, const lh_capture* capture) {
  return guarded(ctx, [&] { given(capture, "capture").value.save(); });
}

void lh_capture_destroy(lh_capture* capture) { delete capture; }

size_t lh_capture_shot_count(const lh_capture* capture) { return capture ? capture->value.shots.size() : 0; }
size_t lh_capture_camera_count(const lh_capture* capture) { return capture ? capture->value.cameras.size() : 0; }

lh_status lh_capture_add_camera(lh_context* ctx, lh_capture* capture, const lh_camera* camera) {
  return guarded(ctx, [&] {
    auto& cameras = given(capture, "capture").value.cameras;
    if (cameras.size() >= kMaxEntries) invalid("a capture has at most 100,000 cameras", "capture");
    cameras.push_back(camera_from(camera, "camera"));
  });
}

lh_status lh_capture_get_camera(lh_context* ctx, const lh_capture* capture, size_t i, lh_camera* camera) {
  return guarded(ctx, [&] {
    const auto& cameras = given(capture, "capture").value.cameras;
    write_struct(camera, camera_to(cameras[index(i, cameras.size(), "index")]), "camera");
  });
}

lh_status lh_capture_set_camera(lh_context* ctx, lh_capture* capture, size_t i, const lh_camera* camera) {
  return guarded(ctx, [&] {
    Capture& c = given(capture, "capture").value;
    c.cameras[index(i, c.cameras.size(), "index")] = camera_from(camera, "camera");
    c.camera_covariances.erase(int(i));
  });
}

lh_status lh_capture_add_shot(lh_context* ctx, lh_capture* capture, const char* name, const char* file, size_t camera) {
  return guarded(ctx, [&] {
    Capture& c = given(capture, "capture").value;
    if (c.shots.size() >= kMaxEntries) invalid("a capture has at most 100,000 shots", "capture");
    c.add_shot(text(name, "name"), path(file, "file"), camera);
  });
}

lh_status lh_capture_shot_name(lh_context* ctx, const lh_capture* capture, size_t shot, char* buffer, size_t size,
                               size_t* needed) {
  return guarded(ctx, [&] { give_text(shot_of(capture, shot).name, buffer, size, needed); });
}

lh_status lh_capture_shot_file(lh_context* ctx, const lh_capture* capture, size_t shot, char* buffer, size_t size,
                               size_t* needed) {
  return guarded(ctx, [&] {
    const Shot& s = shot_of(capture, shot);
    give_text(capture->value.photo_path(s).native(), buffer, size, needed);
  });
}

lh_status lh_capture_shot_camera(lh_context* ctx, const lh_capture* capture, size_t shot, size_t* camera) {
  return guarded(ctx, [&] {
    const int i = shot_of(capture, shot).camera;
    given(camera, "camera") = size_t(i);
  });
}

lh_status lh_capture_shot_held_out(lh_context* ctx, const lh_capture* capture, size_t shot, int32_t* held_out) {
  return guarded(ctx, [&] {
    shot_of(capture, shot);
    given(held_out, "held_out") = capture->value.held_out(shot) ? 1 : 0;
  });
}

lh_status lh_capture_set_hold_out(lh_context* ctx, lh_capture* capture, int32_t n) {
  return guarded(ctx, [&] { given(capture, "capture").value.set_hold_out(n); });
}

lh_status lh_capture_set_background(lh_context* ctx, lh_capture* capture, const uint8_t rgb[3]) {
  return guarded(ctx, [&] {
    given(rgb, "rgb");
    given(capture, "capture").value.background_rgb = {rgb[0], rgb[1], rgb[2]};
  });
}

lh_status lh_capture_get_pose(lh_context* ctx, const lh_capture* capture, size_t shot, double cam_from_world[12]) {
  return guarded(ctx, [&] {
    const Shot& s = shot_of(capture, shot);
    given(cam_from_world, "cam_from_world");
    if (!s.cam_from_world) throw Error(ErrorCode::not_found, "this photograph has no pose", s.name);
    pose_to(*s.cam_from_world, cam_from_world);
  });
}

lh_status lh_capture_set_pose(lh_context* ctx, lh_capture* capture, size_t shot, const double cam_from_world[12]) {
  return guarded(ctx, [&] {
    Shot& s = shot_of(capture, shot);
    std::optional<Pose> pose;
    if (cam_from_world) pose = pose_from(cam_from_world, "cam_from_world");
    s.cam_from_world = pose;
    s.pose_quality.reset();
  });
}

lh_status lh_capture_read_photo(lh_context* ctx, const lh_capture* capture, size_t shot, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    shot_of(capture, shot);
    give(out, capture->value.read_photo(shot));
  });
}

lh_status lh_capture_read_mask(lh_context* ctx, const lh_capture* capture, size_t shot, lh_image** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    shot_of(capture, shot);
    give(out, capture->value.read_mask(shot));
  });
}

lh_status lh_capture_write_mask(lh_context* ctx, lh_capture* capture, size_t shot, const lh_image* mask) {
  return guarded(ctx, [&] {
    shot_of(capture, shot);
    capture->value.write_mask(shot, given(mask, "mask").value, MaskSource::imported);
  });
}

lh_status lh_capture_read_hull(lh_context* ctx, const lh_capture* capture, lh_mesh** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, slf::read_hull(given(capture, "capture").value));
  });
}
