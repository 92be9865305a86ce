#include <lumihull/slf/capture_renderer.h>

#include <filesystem>
#include <numbers>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

struct lh_renderer {
  slf::CaptureRenderer value;
  bool adaptive = false;
};

lh_status lh_renderer_create(lh_context* ctx, const lh_capture* capture, const char* method, lh_renderer** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    *out = new lh_renderer{{given(capture, "capture").value, text(method, "method")}};
  });
}

lh_status lh_renderer_open(lh_context* ctx, const char* file, lh_renderer** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    *out = new lh_renderer{slf::CaptureRenderer{std::filesystem::path(path(file, "file"))}};
  });
}

void lh_renderer_destroy(lh_renderer* renderer) { delete renderer; }

lh_status lh_renderer_set_adaptive(lh_context* ctx, lh_renderer* renderer, int32_t adaptive) {
  return guarded(ctx, [&] { given(renderer, "renderer").adaptive = adaptive != 0; });
}

lh_status lh_renderer_render(lh_context* ctx, lh_renderer* renderer, const lh_camera* camera,
                             const double cam_from_world[12], int32_t rays, uint8_t* rgba, size_t rgba_size,
                             float* depth) {
  return guarded(ctx, [&](Job& job) {
    slf::CaptureRenderer& r = given(renderer, "renderer").value;
    const View view{camera_from(camera, "camera"), pose_from(cam_from_world, "cam_from_world")};
    given(rgba, "rgba");
    const size_t size = size_t(view.camera.width) * size_t(view.camera.height) * 4;
    if (rgba_size < size)
      invalid("expected at least " + std::to_string(size) + " bytes, found " + std::to_string(rgba_size), "rgba_size");
    slf::RenderOptions options;
    options.rays = or_default(int(rays), options.rays);
    options.depth = depth != nullptr;
    options.adaptive = renderer->adaptive;
    const slf::Rendering rendering = r.render(view, options, job);
    std::memcpy(rgba, rendering.rgba.data(), size);
    if (depth) std::memcpy(depth, rendering.depth.data(), rendering.depth.bytes());
  });
}

lh_status lh_renderer_turntable(lh_context* ctx, const lh_renderer* renderer, size_t frames, int32_t width,
                                int32_t height, double elevation_rad, lh_camera* camera, double* cam_from_world) {
  return guarded(ctx, [&] {
    const slf::CaptureRenderer& r = given(renderer, "renderer").value;
    if (frames < 1 || frames > 100'000) invalid("expected 1 to 100,000, found " + std::to_string(frames), "frames");
    array(cam_from_world, frames, 12, "cam_from_world");
    const auto path = r.turntable({.frames = int(frames),
                                   .elevation_deg = elevation_rad * 180 / std::numbers::pi,
                                   .width = width,
                                   .height = height});
    write_struct(camera, camera_to(path.front().view.camera), "camera");
    for (size_t i = 0; i < frames; ++i) pose_to(path[i].view.cam_from_world, cam_from_world + 12 * i);
  });
}
