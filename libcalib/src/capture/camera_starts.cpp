// What is known of a capture's cameras before calibration.
#include <lumihull/base/error.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/lens_calibration.h>

#include <algorithm>
#include <optional>

namespace lumihull::calib {
namespace {

bool same(const Camera& a, const Camera& b) {
  return a.width == b.width && a.height == b.height && a.f == b.f && a.s == b.s && a.skew == b.skew && a.u0 == b.u0 &&
         a.v0 == b.v0 && a.k1 == b.k1 && a.k2 == b.k2 && a.k3 == b.k3 && a.p1 == b.p1 && a.p2 == b.p2;
}

/// The model of the last calibration. One that can't be read is about to be replaced: it is as good as none.
std::optional<TargetModel> last_model(const Capture& capture) {
  try {
    return TargetModel::load(target_model_path(capture));
  } catch (const Error& e) {
    if (e.code() != ErrorCode::not_found && e.code() != ErrorCode::bad_input) throw;
    return std::nullopt;
  }
}

}  // namespace

std::vector<CameraStart> camera_starts(const Capture& capture, const std::filesystem::path& intrinsics) {
  std::optional<Camera> given;
  if (!intrinsics.empty()) given = load_intrinsics(intrinsics).camera;
  const std::optional<TargetModel> last = last_model(capture);
  std::vector<CameraStart> starts;
  bool used = false;
  for (std::size_t i = 0; i < capture.cameras.size(); ++i) {
    const Camera& camera = capture.cameras[i];
    CameraStart start{camera.width, camera.height, std::nullopt, 0};
    const auto shot =
        std::find_if(capture.shots.begin(), capture.shots.end(), [&](const Shot& s) { return s.camera == int(i); });
    if (given && given->width == camera.width && given->height == camera.height) {
      start.camera = given;
      used = true;
    } else if (capture.camera_covariances.contains(int(i)) && last && i < last->starts.size() &&
               last->starts[i].width == camera.width && last->starts[i].height == camera.height) {
      start = last->starts[i];
    } else {
      start.camera = camera;
      if (shot != capture.shots.end()) {
        const HeaderCamera header = camera_of_header(read_image_info(capture.photo_path(*shot)));
        if (same(header.camera, camera)) {
          start.camera.reset();
          if (header.f_known) start.focal_px = camera.f;
        }
      }
    }
    starts.push_back(std::move(start));
  }
  if (given && !used)
    throw Error(ErrorCode::bad_input,
                "is for pictures of " + std::to_string(given->width) + " x " + std::to_string(given->height) +
                    " px; no camera of the capture has that size",
                intrinsics.string());
  return starts;
}

}  // namespace lumihull::calib
