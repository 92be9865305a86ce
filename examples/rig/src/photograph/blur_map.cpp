#include "blur_map.h"

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace lumihull::rig {

using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr float kPlainRoom = 3;  ///< px of blur that paint does not show

/// What one sharp ray sees.
struct Look {
  float depth = 0;  ///< 0: beyond the lens
  int thing = 0;    ///< objects from 1 up, the room's surfaces from -1 down
};

/// Whether an outline passes between two neighbours.
bool outline(const Look& a, const Look& b) {
  return a.thing != b.thing || (a.thing > 0 && std::max(a.depth, b.depth) > 1.02f * std::min(a.depth, b.depth));
}

}  // namespace

BlurMap::BlurMap(const LitScene& scene, const View& view, const PhotoOptions& options, const Shutter& shutter, Job& job)
    : width_(view.camera.width), pixels_(std::size_t(view.camera.width) * std::size_t(view.camera.height)) {
  const int width = view.camera.width, height = view.camera.height;
  const auto index = [&](int x, int y) { return std::size_t(y) * std::size_t(width) + std::size_t(x); };
  std::vector<Look> looks(pixels_.size());
  const Eigen::Matrix3d world_from_cam = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  const Vector3f origin = view.center().cast<float>();
  parallel_chunks(job, std::size_t(height), 8, [&](std::size_t first, std::size_t last) {
    std::vector<hull::Ray> rays(static_cast<std::size_t>(width));
    std::vector<hull::Hit> hits(rays.size());
    for (int y = int(first); y < int(last); ++y) {
      for (int x = 0; x < width; ++x) {
        const auto d = view.camera.ray({x + .5, y + .5});
        rays[std::size_t(x)] = {origin, d ? Vector3f((world_from_cam * *d).cast<float>()) : Vector3f::UnitZ()};
        if (!d) rays[std::size_t(x)].t_far = 0;
      }
      scene.hit(rays, hits);
      for (int x = 0; x < width; ++x) {
        const hull::Ray& ray = rays[std::size_t(x)];
        const hull::Hit& hit = hits[std::size_t(x)];
        Look& look = looks[index(x, y)];
        if (hit) {
          look = {hit.t, 1 + int(scene.object_of(hit.triangle))};
        } else if (ray.t_far > 0) {
          const RoomHit room = scene.room().hit(origin, ray.direction);
          look = {room.t, -1 - room.surface};
        }
      }
    }
  });

  // Motion is the faster the nearer: it is asked at a few depths, and in between that of the nearer one counts.
  float near = INFINITY, far = 0;
  for (const Look& look : looks)
    if (look.depth > 0) near = std::min(near, look.depth), far = std::max(far, look.depth);
  constexpr int kDepths = 8;
  std::vector<double> motion(kDepths, 0.);
  if (far > 0)
    for (int i = 0; i < kDepths; ++i)
      motion[std::size_t(i)] = shutter.motion_px(near * std::pow(far / near, double(i) / kDepths));
  const auto blur = [&](const Look& look) -> float {  // diameter, px
    if (!(look.depth > 0)) return 0;
    const double i = far > near ? kDepths * std::log(look.depth / near) / std::log(far / near) : 0;
    return float(shutter.confusion_px(look.depth) + motion[std::size_t(std::clamp(int(i), 0, kDepths - 1))]);
  };

  // A square around each pixel of an outline, as wide as the wider blur of both sides; squares are counted by their
  // corners and summed up afterwards.
  const std::size_t stride = std::size_t(width) + 1;
  std::vector<int> count(stride * std::size_t(height + 1), 0);
  const auto mark = [&](int x, int y, float diameter) {
    // Moving pictures go to one side as far as the whole motion.
    const int r = int(std::ceil(diameter + 1));
    const int x0 = std::max(0, x - r), x1 = std::min(width, x + r + 1), y0 = std::max(0, y - r),
              y1 = std::min(height, y + r + 1);
    ++count[std::size_t(y0) * stride + std::size_t(x0)], --count[std::size_t(y0) * stride + std::size_t(x1)];
    --count[std::size_t(y1) * stride + std::size_t(x0)], ++count[std::size_t(y1) * stride + std::size_t(x1)];
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Look& look = looks[index(x, y)];
      for (const auto& [u, v] : {std::pair{x + 1, y}, std::pair{x, y + 1}}) {
        if (u >= width || v >= height) continue;
        const Look& next = looks[index(u, v)];
        if (outline(look, next)) mark(x, y, std::max(blur(look), blur(next)));
      }
    }
  for (int y = 0; y <= height; ++y)
    for (std::size_t x = 1; x < stride; ++x)
      count[std::size_t(y) * stride + x] += count[std::size_t(y) * stride + x - 1];
  for (int y = 1; y <= height; ++y)
    for (std::size_t x = 0; x < stride; ++x)
      count[std::size_t(y) * stride + x] += count[std::size_t(y - 1) * stride + x];
  const int most = std::max(options.rays, options.edge_rays);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Look& look = looks[index(x, y)];
      const float diameter = blur(look);
      const bool near_outline = count[std::size_t(y) * stride + std::size_t(x)] > 0;
      const int side = std::min(most, options.rays * (1 + int(diameter / 3)));
      pixels_[index(x, y)] = {near_outline ? most : side, !near_outline && look.thing < 0 && diameter < kPlainRoom};
    }
}

}  // namespace lumihull::rig
