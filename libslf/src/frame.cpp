#include "frame.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "color.h"

namespace lumihull::slf {
namespace {

constexpr int kTileSide = 32;

struct Level {
  int width, height;
  std::vector<std::array<float, 4>> cells;  // premultiplied colour and weight
};

Level halved(const Level& fine) {
  Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
  coarse.cells.assign(std::size_t(coarse.width) * coarse.height, {0, 0, 0, 0});
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x) {
      const auto& f = fine.cells[std::size_t(y) * fine.width + x];
      auto& c = coarse.cells[std::size_t(y / 2) * coarse.width + x / 2];
      for (int i = 0; i < 4; ++i) c[i] += f[i];
    }
  for (auto& c : coarse.cells)
    if (c[3] > 1) c = {c[0] / c[3], c[1] / c[3], c[2] / c[3], 1};
  return coarse;
}

}  // namespace

Frame::Frame(const View& view, const RenderOptions& options) : view_(view), options_(options) {
  if (options.rays < 1 || options.rays > 8)
    throw Error(ErrorCode::invalid_argument,
                "expected 1 to 8 rays along a pixel's side, not " + std::to_string(options.rays));
  try {
    view.camera.validate();
  } catch (const Error& e) {
    throw Error(ErrorCode::invalid_argument, e.message(), "camera of the new view");
  }
  if (!view.cam_from_world.rotation.coeffs().allFinite() || !view.cam_from_world.translation.allFinite())
    throw Error(ErrorCode::invalid_argument, "the pose is not finite", "camera of the new view");
  columns_ = (view.camera.width + kTileSide - 1) / kTileSide;
  rows_ = (view.camera.height + kTileSide - 1) / kTileSide;
  center_ = view.center();
  world_from_cam_ = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  out_.rgba = Image(view.camera.width, view.camera.height, 4);
  if (options.depth) {
    out_.depth = Image(view.camera.width, view.camera.height, 1, PixelType::f32);
    for (int y = 0; y < view.camera.height; ++y)
      std::fill_n(out_.depth.row<float>(y), view.camera.width, std::numeric_limits<float>::infinity());
  }
  holes_.resize(tiles());
}

Tile Frame::tile(std::size_t i) const {
  const int x0 = int(i % columns_) * kTileSide, y0 = int(i / columns_) * kTileSide;
  return {x0, y0, std::min(kTileSide, view_.camera.width - x0), std::min(kTileSide, view_.camera.height - y0)};
}

std::vector<SurfaceSample> Frame::trace(const Tile& tile, const hull::RayScene& scene, const hull::Mesh& mesh) const {
  const int n = options_.rays;
  const std::size_t count = std::size_t(tile.width) * tile.height * n * n;
  std::vector<hull::Ray> rays;
  std::vector<std::uint32_t> pixels;
  rays.reserve(count), pixels.reserve(count);
  const Eigen::Vector3f origin = center_.cast<float>();
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; ++x)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const auto ray = view_.camera.ray({tile.x0 + x + (i + 0.5) / n, tile.y0 + y + (j + 0.5) / n});
          if (!ray) continue;
          rays.push_back({origin, (world_from_cam_ * *ray).cast<float>()});
          pixels.push_back(std::uint32_t(y * tile.width + x));
        }
  std::vector<hull::Hit> hits(rays.size());
  scene.hit(rays, hits);
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i]) continue;
    const auto& t = mesh.triangles[hits[i].triangle];
    const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    samples.push_back({pixels[i], hits[i], a + hits[i].b1 * (b - a) + hits[i].b2 * (c - a)});
  }
  return samples;
}

void Frame::resolve(const Tile& tile, const std::vector<SurfaceSample>& samples,
                    const std::vector<BlendColor>& colors) {
  const int per_pixel = options_.rays * options_.rays;
  const std::size_t tile_index = std::size_t(tile.y0 / kTileSide) * columns_ + tile.x0 / kTileSide;
  for (std::size_t first = 0; first < samples.size();) {
    const std::uint32_t pixel = samples[first].pixel;
    float r = 0, g = 0, b = 0, depth = std::numeric_limits<float>::infinity();
    int known = 0;
    std::size_t last = first;
    for (; last < samples.size() && samples[last].pixel == pixel; ++last) {
      depth = std::min(depth, samples[last].hit.t);
      if (!(colors[last].weight > 0)) continue;
      r += colors[last].r, g += colors[last].g, b += colors[last].b;
      ++known;
    }
    const int x = tile.x0 + int(pixel) % tile.width, y = tile.y0 + int(pixel) / tile.width;
    std::uint8_t* out = out_.rgba.row<std::uint8_t>(y) + 4 * x;
    if (known) {
      out[0] = srgb8_of_unit(r / float(known));
      out[1] = srgb8_of_unit(g / float(known));
      out[2] = srgb8_of_unit(b / float(known));
    } else {
      holes_[tile_index].push_back(std::uint32_t(y) * std::uint32_t(view_.camera.width) + std::uint32_t(x));
    }
    out[3] = std::uint8_t((int(last - first) * 255 + per_pixel / 2) / per_pixel);
    if (!out_.depth.empty()) out_.depth.row<float>(y)[x] = depth;
    first = last;
  }
}

Rendering Frame::finish() {
  std::vector<std::uint32_t> holes;
  for (const auto& of_tile : holes_) holes.insert(holes.end(), of_tile.begin(), of_tile.end());
  if (holes.empty()) return std::move(out_);

  // Push-pull (Gortler et al. 1996, section 3.4): means over ever larger squares, until each hole finds a colour.
  std::vector<Level> levels;
  levels.push_back({out_.rgba.width(), out_.rgba.height(), {}});
  levels[0].cells.assign(std::size_t(out_.rgba.width()) * out_.rgba.height(), {0, 0, 0, 0});
  for (int y = 0; y < out_.rgba.height(); ++y) {
    const std::uint8_t* p = out_.rgba.row<std::uint8_t>(y);
    for (int x = 0; x < out_.rgba.width(); ++x) {
      const float w = float(p[4 * x + 3]) / 255;
      levels[0].cells[std::size_t(y) * out_.rgba.width() + x] = {
          w * unit_of_srgb8(p[4 * x]), w * unit_of_srgb8(p[4 * x + 1]), w * unit_of_srgb8(p[4 * x + 2]), w};
    }
  }
  for (const std::uint32_t hole : holes) levels[0].cells[hole] = {0, 0, 0, 0};
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(halved(levels.back()));
  for (const std::uint32_t hole : holes) {
    int x = int(hole % std::uint32_t(out_.rgba.width())), y = int(hole / std::uint32_t(out_.rgba.width()));
    std::uint8_t* out = out_.rgba.row<std::uint8_t>(y) + 4 * x;
    std::array<float, 4> sum{};
    for (std::size_t l = 1; l < levels.size() && sum[3] < 1; ++l) {
      const Level& level = levels[l];
      // Bilinear between the four cells around the hole, so that no squares show.
      const float fx = (float(x) + 0.5f) / float(1 << l) - 0.5f, fy = (float(y) + 0.5f) / float(1 << l) - 0.5f;
      const int cx = int(std::floor(fx)), cy = int(std::floor(fy));
      std::array<float, 4> here{};
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
          const int qx = std::clamp(cx + i, 0, level.width - 1), qy = std::clamp(cy + j, 0, level.height - 1);
          const float w = (i ? fx - float(cx) : 1 - fx + float(cx)) * (j ? fy - float(cy) : 1 - fy + float(cy));
          for (int k = 0; k < 4; ++k) here[k] += w * level.cells[std::size_t(qy) * level.width + qx][k];
        }
      const float share = std::min(1.0f, (1 - sum[3]) / std::max(here[3], 1e-12f));
      for (int k = 0; k < 4; ++k) sum[k] += share * here[k];
    }
    for (int c = 0; c < 3; ++c) out[c] = sum[3] > 0 ? srgb8_of_unit(sum[c] / sum[3]) : 128;
  }
  return std::move(out_);
}

}  // namespace lumihull::slf
