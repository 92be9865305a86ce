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
// In barycentric coordinates: how far outside of a triangle its plane still stands for the surface.
constexpr float kBeside = 0.1f;

void check(const View& view, const RenderOptions& options) {
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
}

/// Where the mesh is, as (x / z, y / z) in the camera's frame; anywhere if it is not all before the camera.
Eigen::AlignedBox2d bounds_seen(const View& view, const hull::Mesh& mesh) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::AlignedBox2d box;
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.toRotationMatrix();
  for (const auto& v : mesh.vertices) {
    const Eigen::Vector3d p = rotation * v.cast<double>() + view.cam_from_world.translation;
    if (!(p.z() > 0)) return {Eigen::Vector2d(-kInfinity, -kInfinity), Eigen::Vector2d(kInfinity, kInfinity)};
    box.extend(Eigen::Vector2d(p.head<2>() / p.z()));
  }
  return box;
}

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

Frame::Frame(const View& view, const RenderOptions& options, const hull::Mesh& mesh, const hull::RayScene& scene,
             const std::vector<MeshEdge>* edges)
    : view_((check(view, options), view)),
      options_(options),
      mesh_(mesh),
      scene_(scene),
      rays_(view),
      columns_((view.camera.width + kTileSide - 1) / kTileSide),
      rows_((view.camera.height + kTileSide - 1) / kTileSide),
      center_(view.center()),
      seen_(bounds_seen(view, mesh)),
      adaptive_(options.adaptive && options.rays > 1 && rays_.everywhere()) {
  if (adaptive_) adaptive_ = mark_outlines(view, mesh, edges ? *edges : mesh_edges(mesh), marked_);
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

SurfaceSample Frame::sample(std::uint32_t pixel, const hull::Hit& hit) const {
  const auto& t = mesh_.triangles[hit.triangle];
  const Eigen::Vector3f &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
  return {pixel, hit, a + hit.b1 * (b - a) + hit.b2 * (c - a), false};
}

/// n x n rays for each of the pixels; hits in their order.
std::vector<hull::Hit> Frame::cast(const Tile& tile, const std::vector<std::uint32_t>& pixels, int n) const {
  const std::size_t count = pixels.size() * std::size_t(n * n);
  std::vector<double> at(2 * count);
  std::vector<float> directions(3 * count);
  double *u = at.data(), *v = u + count;
  std::size_t k = 0;
  for (const std::uint32_t pixel : pixels) {
    const int x = tile.x0 + int(pixel) % tile.width, y = tile.y0 + int(pixel) / tile.width;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i, ++k) u[k] = x + (i + 0.5) / n, v[k] = y + (j + 0.5) / n;
  }
  float *x = directions.data(), *y = x + count, *z = y + count;
  rays_.fill(count, u, v, x, y, z);
  std::vector<hull::Hit> hits(count);
  scene_.hit(center_.cast<float>(), {{x, count}, {y, count}, {z, count}}, hits);
  return hits;
}

Frame::Plane Frame::plane(const hull::Hit& hit, const Eigen::Matrix<float, 3, 2>& slopes) const {
  // Cramer's rule for eye + t d = a + b1 e1 + b2 e2 (Möller & Trumbore 1997): t = t' / (d normal), b = (d q) / (d
  // normal) with all of them linear in d, and so in the pixel.
  const auto& t = mesh_.triangles[hit.triangle];
  const Eigen::Vector3f& a = mesh_.vertices[t[0]];
  const Eigen::Vector3f e1 = mesh_.vertices[t[1]] - a, e2 = mesh_.vertices[t[2]] - a;
  const Eigen::Vector3f s = center_.cast<float>() - a;
  const Eigen::Vector3f normal = e2.cross(e1);
  const Eigen::Matrix<float, 2, 3> by_pixel = slopes.transpose() * (-hit.t / normal.dot(s));
  return {hit, by_pixel * normal, by_pixel * e2.cross(s), by_pixel * s.cross(e1)};
}

bool Frame::Plane::holds(int n) const {
  const float end = 0.5f - 0.5f / float(n);
  bool good = true;
  for (const Eigen::Vector2f& off : {Eigen::Vector2f(-end, -end), {end, -end}, {-end, end}, {end, end}}) {
    const hull::Hit h = at(off);
    good = good && h.t > 0 && std::min({h.b1, h.b2, 1 - h.b1 - h.b2}) > -kBeside;
  }
  return good;
}

std::vector<SurfaceSample> Frame::trace(const Tile& tile) const {
  std::vector<SurfaceSample> samples;
  if (!rays_.bounds(tile.x0, tile.y0, tile.width, tile.height).intersects(seen_)) return samples;
  const int n = options_.rays, inside = n > 2 ? (n + 1) / 2 : n;
  const std::size_t per_pixel = std::size_t(n * n), count = std::size_t(tile.width) * std::size_t(tile.height);

  // Pixels in the order of their rays: squares of so many that their rays fill a packet.
  const int side = n == 1 || adaptive_ ? 4 : n == 2 ? 2 : 1;
  std::vector<std::uint32_t> many, single;
  for (int by = 0; by < tile.height; by += side)
    for (int bx = 0; bx < tile.width; bx += side)
      for (int y = by; y < std::min(by + side, tile.height); ++y)
        for (int x = bx; x < std::min(bx + side, tile.width); ++x) {
          const bool one =
              adaptive_ &&
              !marked_[std::size_t(tile.y0 + y) * std::size_t(view_.camera.width) + std::size_t(tile.x0 + x)];
          (one ? single : many).push_back(std::uint32_t(y * tile.width + x));
        }

  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<Plane> planes;
  std::vector<std::uint32_t> plane_of(count, kNone), first_hit(count, kNone);
  std::size_t most = 0;
  if (!single.empty()) {
    const std::vector<hull::Hit> centers = cast(tile, single, 1);
    const auto slopes = rays_.slopes({tile.x0 + 0.5 * tile.width, tile.y0 + 0.5 * tile.height});
    for (std::size_t i = 0; i < single.size(); ++i) {
      if (!centers[i]) continue;
      const Plane p = plane(centers[i], slopes);
      if (p.holds(inside)) {
        plane_of[single[i]] = std::uint32_t(planes.size());
        planes.push_back(p);
      } else {
        many.push_back(single[i]);
      }
    }
    most = planes.size() * std::size_t(inside * inside);
  }
  const std::vector<hull::Hit> hits = cast(tile, many, n);
  for (std::size_t i = 0; i < many.size(); ++i) first_hit[many[i]] = std::uint32_t(i * per_pixel);

  samples.reserve(most + hits.size());
  for (std::uint32_t pixel = 0; pixel < count; ++pixel) {
    if (plane_of[pixel] != kNone) {
      for (int j = 0; j < inside; ++j)
        for (int i = 0; i < inside; ++i) {
          const Eigen::Vector2f off((float(i) + 0.5f) / float(inside) - 0.5f, (float(j) + 0.5f) / float(inside) - 0.5f);
          samples.push_back(sample(pixel, planes[plane_of[pixel]].at(off)));
          samples.back().whole = true;
        }
    } else if (first_hit[pixel] != kNone) {
      for (std::size_t k = first_hit[pixel]; k < first_hit[pixel] + per_pixel; ++k)
        if (hits[k]) samples.push_back(sample(pixel, hits[k]));
    }
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
    const int hits = samples[first].whole ? per_pixel : int(last - first);
    out[3] = std::uint8_t((hits * 255 + per_pixel / 2) / per_pixel);
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
