#include "sheets.h"

#include <lumihull/base/parallel.h>

#include <vector>

#include "blurred_coverage.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;

constexpr int kScanLines = 16;  ///< a pixel where edges pass: shares to 1e-4

std::vector<FlatPrint> whitened(std::vector<FlatPrint> prints) {
  for (FlatPrint& print : prints) {
    print.paper = Vector3f::Ones();
    print.shapes.clear();
  }
  return prints;
}

}  // namespace

void add_sheets(const LitScene& scene, const View& view, double blur_px, const Image& cover, Image& light, Job& job) {
  if (scene.sheets().empty()) return;
  // What sheets reflect, already weighed with the part of the pixel that they take; and that part.
  const Image reflected = blurred_coverage(view, scene.sheets(), Vector3f::Zero(), kScanLines, blur_px);
  const Image part = blurred_coverage(view, whitened(scene.sheets()), Vector3f::Zero(), kScanLines, blur_px);
  const Vector3f origin = view.center().cast<float>();
  const Eigen::Matrix3d world_from_cam = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  parallel_chunks(job, std::size_t(light.height()), 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) {
      float* out = light.row<float>(int(y));
      const float* paper = part.row<float>(int(y));
      const float* print = reflected.row<float>(int(y));
      const float* object = cover.row<float>(int(y));
      for (int x = 0; x < light.width(); ++x) {
        const float share = paper[3 * x], open = 1 - object[x];
        if (!(share > 0) || !(open > 0)) continue;
        const auto ray = view.camera.ray({x + .5, double(y) + .5});
        if (!ray) continue;
        const RoomHit hit = scene.room().hit(origin, (world_from_cam * *ray).cast<float>());
        if (hit.surface == Room::kPedestalTop || hit.surface == Room::kPedestalSide) continue;
        const Vector3f lit = scene.room_light(hit), paint = scene.room().paint(hit);
        for (int c = 0; c < 3; ++c) out[3 * x + c] += open * lit[c] * (print[3 * x + c] - share * paint[c]);
      }
    }
  });
}

}  // namespace lumihull::rig
