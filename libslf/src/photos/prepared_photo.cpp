#include "prepared_photo.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "color.h"
#include "rim.h"

namespace lumihull::slf {
namespace {

constexpr int kStep = 3, kDiagonal = 4;  // chamfer distance (Borgefors 1986): thirds of a pixel

/// Distance to the nearest pixel whose alpha is below one half, in thirds of a pixel, at most 255. The picture's border
/// is no edge of the object.
std::vector<std::uint8_t> distance_to_background(const Image& alpha) {
  const int w = alpha.width(), h = alpha.height();
  std::vector<std::uint8_t> d(std::size_t(w) * h);
  const auto relax = [](int& best, int neighbour, int step) { best = std::min(best, neighbour + step); };
  for (int y = 0; y < h; ++y) {
    const std::uint8_t* a = alpha.row<std::uint8_t>(y);
    std::uint8_t* row = &d[std::size_t(y) * w];
    const std::uint8_t* up = y > 0 ? row - w : nullptr;
    for (int x = 0; x < w; ++x) {
      int best = a[x] < 128 ? 0 : 255;
      if (best) {
        if (x > 0) relax(best, row[x - 1], kStep);
        if (up) {
          relax(best, up[x], kStep);
          if (x > 0) relax(best, up[x - 1], kDiagonal);
          if (x + 1 < w) relax(best, up[x + 1], kDiagonal);
        }
      }
      row[x] = std::uint8_t(best);
    }
  }
  for (int y = h - 1; y >= 0; --y) {
    std::uint8_t* row = &d[std::size_t(y) * w];
    const std::uint8_t* down = y + 1 < h ? row + w : nullptr;
    for (int x = w - 1; x >= 0; --x) {
      int best = row[x];
      if (best) {
        if (x + 1 < w) relax(best, row[x + 1], kStep);
        if (down) {
          relax(best, down[x], kStep);
          if (x > 0) relax(best, down[x - 1], kDiagonal);
          if (x + 1 < w) relax(best, down[x + 1], kDiagonal);
        }
      }
      row[x] = std::uint8_t(best);
    }
  }
  return d;
}

struct Offset {
  std::int16_t dx, dy;  // to the nearest solid pixel; kFar: none known
};
constexpr std::int16_t kFar = std::numeric_limits<std::int16_t>::max();

/// The nearest solid pixel of each pixel, by two passes that hand offsets on (Danielsson 1980: exact but for rare ties
/// of a fraction of a pixel).
std::vector<Offset> nearest_solid(const std::vector<std::uint8_t>& solid, int w, int h) {
  std::vector<Offset> nearest(solid.size());
  for (std::size_t i = 0; i < solid.size(); ++i) nearest[i] = solid[i] ? Offset{0, 0} : Offset{kFar, kFar};
  const auto squared = [](const Offset& o) { return int(o.dx) * o.dx + int(o.dy) * o.dy; };
  const auto relax = [&](Offset& best, const Offset& neighbour, int dx, int dy) {
    if (neighbour.dx == kFar) return;
    const int x = neighbour.dx + dx, y = neighbour.dy + dy;
    if (std::abs(x) >= 16000 || std::abs(y) >= 16000) return;
    const Offset candidate{std::int16_t(x), std::int16_t(y)};
    if (best.dx == kFar || squared(candidate) < squared(best)) best = candidate;
  };
  for (int y = 0; y < h; ++y) {
    Offset* row = &nearest[std::size_t(y) * w];
    if (y > 0)
      for (int x = 0; x < w; ++x) {
        if (x > 0) relax(row[x], row[x - 1 - w], -1, -1);
        relax(row[x], row[x - w], 0, -1);
        if (x + 1 < w) relax(row[x], row[x + 1 - w], 1, -1);
      }
    for (int x = 1; x < w; ++x) relax(row[x], row[x - 1], -1, 0);
    for (int x = w - 2; x >= 0; --x) relax(row[x], row[x + 1], 1, 0);
  }
  for (int y = h - 2; y >= 0; --y) {
    Offset* row = &nearest[std::size_t(y) * w];
    for (int x = 0; x < w; ++x) {
      if (x > 0) relax(row[x], row[x - 1 + w], -1, 1);
      relax(row[x], row[x + w], 0, 1);
      if (x + 1 < w) relax(row[x], row[x + 1 + w], 1, 1);
    }
    for (int x = 1; x < w; ++x) relax(row[x], row[x - 1], -1, 0);
    for (int x = w - 2; x >= 0; --x) relax(row[x], row[x + 1], 1, 0);
  }
  return nearest;
}

}  // namespace

PreparedPhoto::PreparedPhoto(const Photo& photo, const EdgeOptions& edge, const Camera& camera, const std::string& name)
    : width_(photo.rgb.width()), height_(photo.rgb.height()) {
  const Image &rgb = photo.rgb, &alpha = photo.alpha;
  if (rgb.type() != PixelType::u8 || rgb.channels() != 3 || alpha.type() != PixelType::u8 || alpha.channels() != 1)
    throw Error(ErrorCode::bad_input, "expected an 8-bit RGB photograph and an 8-bit mask of one channel", name);
  if (width_ != camera.width || height_ != camera.height || alpha.width() != width_ || alpha.height() != height_)
    throw Error(ErrorCode::bad_input,
                "photograph, mask and camera differ in size: " + std::to_string(width_) + " x " +
                    std::to_string(height_) + ", " + std::to_string(alpha.width()) + " x " +
                    std::to_string(alpha.height()) + ", " + std::to_string(camera.width) + " x " +
                    std::to_string(camera.height),
                name);

  const std::vector<std::uint8_t> distance = distance_to_background(alpha);
  std::vector<std::uint8_t> weight(distance.size()), solid(distance.size());
  const float reach = edge.erosion_px + edge.feather_px + 2;
  const Rim rim(photo);
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* a = alpha.row<std::uint8_t>(y);
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = std::size_t(y) * width_ + x;
      // A pixel next to the background is half a pixel away from the edge between them.
      const float d = float(distance[i]) / kStep - 0.5f;
      const float ramp =
          distance[i] == 255 ? 1.0f : std::clamp((d - edge.erosion_px) / std::max(edge.feather_px, 1e-3f), 0.0f, 1.0f);
      weight[i] = std::uint8_t(std::max(1.0f, std::round(ramp * float(a[x]))));
      solid[i] = float(a[x]) >= 255 * edge.edge_alpha && weight[i] >= 32;
      if (edge.clean_rim && solid[i] && a[x] < kWholePixel && rim.is_mixture(x, y, reach)) solid[i] = 0;
    }
  }
  const std::vector<Offset> nearest = nearest_solid(solid, width_, height_);
  // Parts too thin to have a solid core keep their own colours.
  pixels_.resize(distance.size());
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = std::size_t(y) * width_ + x;
      int sx = x, sy = y;
      const Offset o = nearest[i];
      if (!solid[i] && o.dx != kFar) {
        const bool thin = distance[i] > 0 && float(o.dx) * o.dx + float(o.dy) * o.dy > reach * reach;
        if (!thin) sx += o.dx, sy += o.dy;
      }
      const std::uint8_t* p = rgb.row<std::uint8_t>(sy) + 3 * sx;
      pixels_[i] = {p[0], p[1], p[2], weight[i]};
    }
}

PreparedPhoto::Sample PreparedPhoto::sample(float u, float v) const {
  const float x = std::clamp(u - 0.5f, 0.0f, float(width_ - 1)), y = std::clamp(v - 0.5f, 0.0f, float(height_ - 1));
  const int x0 = std::min(int(x), width_ - 1), y0 = std::min(int(y), height_ - 1);
  const int x1 = std::min(x0 + 1, width_ - 1), y1 = std::min(y0 + 1, height_ - 1);
  const float fx = x - float(x0), fy = y - float(y0);
  const Pixel* const p[4] = {&pixels_[std::size_t(y0) * width_ + x0], &pixels_[std::size_t(y0) * width_ + x1],
                             &pixels_[std::size_t(y1) * width_ + x0], &pixels_[std::size_t(y1) * width_ + x1]};
  const float b[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  float r = 0, g = 0, bl = 0, sum = 0;
  for (int i = 0; i < 4; ++i) {
    const float w = b[i] * float(p[i]->weight);
    r += w * unit_of_srgb8(p[i]->r), g += w * unit_of_srgb8(p[i]->g), bl += w * unit_of_srgb8(p[i]->b);
    sum += w;
  }
  const float scale = 1 / sum;  // weights are at least 1, the b sum to 1
  return {r * scale, g * scale, bl * scale, sum / 255};
}

}  // namespace lumihull::slf
