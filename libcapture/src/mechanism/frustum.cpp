// Cables that run through the picture.
#include <lumihull/base/error.h>
#include <lumihull/capture/clearance.h>

#include <algorithm>
#include <array>

#include "geometry.h"

namespace lumihull::capture {
namespace {

constexpr double kNear_m = 1e-3;
constexpr int kSamples = 32;  ///< rays along each side of the picture

/// Bounds of x / z and y / z over the picture's border.
Eigen::AlignedBox2d border(const Camera& camera) {
  Eigen::AlignedBox2d box;
  for (int i = 0; i <= kSamples; ++i) {
    const double u = double(camera.width) * i / kSamples, v = double(camera.height) * i / kSamples;
    const std::array<Eigen::Vector2d, 4> pixels = {
        {{u, 0}, {u, double(camera.height)}, {0, v}, {double(camera.width), v}}};
    for (const Eigen::Vector2d& pixel : pixels) {
      const auto ray = camera.ray(pixel);
      if (!ray) throw Error(ErrorCode::degenerate, "the picture's border is beyond the lens model's domain", "camera");
      box.extend(Eigen::Vector2d(ray->head<2>() / ray->z()));
    }
  }
  return box;
}

}  // namespace

std::vector<CableInPicture> cables_in_picture(const Mechanism& mechanism, const Pose& world_from_platform,
                                              const Camera& camera, const Pose& cam_from_world) {
  internal::need_usable(mechanism, world_from_platform);
  camera.validate();
  const Eigen::AlignedBox2d box = border(camera);
  // Points inside have plane . point >= offset.
  struct Plane {
    Eigen::Vector3d normal;
    double offset;
  };
  const std::array<Plane, 5> planes = {{{{0, 0, 1}, kNear_m},
                                        {{1, 0, -box.min().x()}, 0},
                                        {{-1, 0, box.max().x()}, 0},
                                        {{0, 1, -box.min().y()}, 0},
                                        {{0, -1, box.max().y()}, 0}}};
  std::vector<CableInPicture> result;
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i) {
    const Eigen::Vector3d from = cam_from_world * (world_from_platform * mechanism.cables[i].attachment);
    const Eigen::Vector3d along = cam_from_world * mechanism.cables[i].departure - from;
    double enter = 0, leave = 1;
    for (const Plane& plane : planes) {
      const double start = plane.normal.dot(from) - plane.offset, slope = plane.normal.dot(along);
      if (slope > 0)
        enter = std::max(enter, -start / slope);
      else if (slope < 0)
        leave = std::min(leave, -start / slope);
      else if (start < 0)
        leave = -1;
    }
    if (!(enter < leave)) continue;
    CableInPicture seen;
    seen.cable = int(i);
    seen.from_m = from + enter * along, seen.to_m = from + leave * along;
    seen.from_px = camera.project(seen.from_m), seen.to_px = camera.project(seen.to_m);
    result.push_back(seen);
  }
  return result;
}

}  // namespace lumihull::capture
