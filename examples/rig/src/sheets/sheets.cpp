#include "sheets.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "photograph/blurred_coverage.h"
#include "photograph/gaussian_blur.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;

constexpr int kScanLines = 16;  ///< a pixel where edges pass: shares to 1e-4

constexpr double kMomentStep = .75;  ///< px
constexpr int kMoments = 32;

/// A part of the picture, from (x0, y0) on.
struct Crop {
  int x0 = 0, y0 = 0, width = 0, height = 0;
  Image reflected, part;  ///< what the sheet reflects, weighed with the part of the pixel that it takes; that part
};

/// Where a sheet is in the picture, enlarged by `margin` px; empty where it is not. Sheets that reach behind the
/// camera, or beyond the lens, are looked at more closely.
Crop crop_of(const FlatPrint& print, std::span<const View> views, double margin) {
  const Camera& camera = views[0].camera;
  const Eigen::AlignedBox2d picture(Eigen::Vector2d(0, 0), Eigen::Vector2d(camera.width, camera.height));
  Eigen::AlignedBox2d box;
  for (const int steps : {8, 64}) {
    bool all = true;
    box.setEmpty();
    for (const View& view : views)
      for (int i = 0; i <= steps; ++i)
        for (int j = 0; j <= steps; ++j) {
          const Eigen::Vector2d at = (print.low + Eigen::Vector2d(i, j).cwiseProduct(print.high - print.low) / steps)
                                         .cwiseProduct(print.stretch);
          const auto px = view.project(print.world_from_print * Eigen::Vector3d(at.x(), at.y(), 0));
          all = all && px;
          // A coarse look counts what is beside the picture, too: a sheet may lie across it.
          if (px && (steps == 8 || picture.contains(*px))) box.extend(*px);
        }
    if (box.isEmpty()) return {};
    margin += steps == 64 ? .05 * box.diagonal().norm() : 0;
    if (all) break;
  }
  const auto within = [](double px, int size) { return int(std::clamp(px, 0., double(size))); };
  const int x0 = within(std::floor(box.min().x() - margin), camera.width);
  const int y0 = within(std::floor(box.min().y() - margin), camera.height);
  return {x0,
          y0,
          within(std::ceil(box.max().x() + margin), camera.width) - x0,
          within(std::ceil(box.max().y() + margin), camera.height) - y0,
          {},
          {}};
}

bool meet(const Crop& a, const Crop& b) {
  return a.x0 < b.x0 + b.width && b.x0 < a.x0 + a.width && a.y0 < b.y0 + b.height && b.y0 < a.y0 + a.height;
}

void paint_all(FlatPrint& print, float value) {
  print.paper = Vector3f::Constant(value);
  print.shapes.clear();
}

}  // namespace

void add_sheets(const LitScene& scene, const View& view, const Shutter& shutter, double blur_px, const Image& cover,
                Image& light, Job& job) {
  const std::vector<FlatPrint>& sheets = scene.sheets();
  if (sheets.empty()) return;
  std::vector<double> sigma(sheets.size());
  double nearest = INFINITY;
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const double depth = (view.cam_from_world * (sheets[i].world_from_print * Eigen::Vector3d(0, 0, 0))).z();
    sigma[i] = blur_px;
    if (!(depth > 0)) continue;
    sigma[i] = std::hypot(blur_px, shutter.confusion_px(depth) / 4);
    nearest = std::min(nearest, depth);
  }
  std::vector<View> views{view};
  if (shutter.moves() && std::isfinite(nearest)) {
    const int n = std::clamp(int(std::ceil(shutter.motion_px(nearest) / kMomentStep)), 1, kMoments);
    views.clear();
    for (int i = 0; i < n; ++i) views.push_back({view.camera, shutter.at((i + .5) / n).cam_from_world()});
  }
  std::vector<Crop> crops(sheets.size());
  for (std::size_t i = 0; i < sheets.size(); ++i) crops[i] = crop_of(sheets[i], views, 2 + kGaussianReach * sigma[i]);
  parallel_for(job, sheets.size(), [&](std::size_t i) {
    Crop& crop = crops[i];
    if (crop.width <= 0 || crop.height <= 0) return;
    // Those before it hide it: they are there, too, but black. All stay in their order, which decides where they touch.
    std::vector<FlatPrint> prints;
    std::size_t own = 0;
    for (std::size_t j = 0; j < sheets.size(); ++j)
      if (meet(crop, crops[j])) {
        if (j == i) own = prints.size();
        prints.push_back(sheets[j]);
        if (j != i) paint_all(prints.back(), 0);
      }
    std::vector<View> parts = views;
    for (View& v : parts) {
      v.camera.width = crop.width, v.camera.height = crop.height;
      v.camera.u0 -= crop.x0, v.camera.v0 -= crop.y0;
    }
    crop.reflected = blurred_coverage(parts, prints, Vector3f::Zero(), kScanLines, sigma[i]);
    paint_all(prints[own], 1);
    crop.part = blurred_coverage(parts, prints, Vector3f::Zero(), kScanLines, sigma[i]);
  });

  const Vector3f origin = view.center().cast<float>();
  const Eigen::Matrix3d world_from_cam = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  for (const Crop& crop : crops) {  // one after the other: sums do not depend on the threads
    if (crop.part.empty()) continue;
    parallel_chunks(job, std::size_t(crop.height), 8, [&](std::size_t first, std::size_t last) {
      for (int row = int(first); row < int(last); ++row) {
        const int y = crop.y0 + row;
        float* out = light.row<float>(y);
        const float* paper = crop.part.row<float>(row);
        const float* print = crop.reflected.row<float>(row);
        const float* object = cover.row<float>(y);
        for (int i = 0; i < crop.width; ++i) {
          const int x = crop.x0 + i;
          const float share = paper[3 * i], open = 1 - object[x];
          if (!(share > 0) || !(open > 0)) continue;
          const auto ray = view.camera.ray({x + .5, y + .5});
          if (!ray) continue;
          const RoomHit hit = scene.room().hit(origin, (world_from_cam * *ray).cast<float>());
          if (hit.surface == Room::kPedestalTop || hit.surface == Room::kPedestalSide) continue;
          const Vector3f lit = scene.room_light(hit), paint = scene.room().paint(hit);
          for (int c = 0; c < 3; ++c) out[3 * x + c] += open * lit[c] * (print[3 * i + c] - share * paint[c]);
        }
      }
    });
  }
}

}  // namespace lumihull::rig
