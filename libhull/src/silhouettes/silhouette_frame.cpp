#include "silhouette_frame.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::hull {

SilhouetteMaker::Frame::Frame(const Camera& camera_in, double cell_px) : camera(camera_in) {
  camera.validate();
  if (!(cell_px >= 1 && cell_px <= 64))
    throw Error(ErrorCode::invalid_argument, "cell_px must be from 1 to 64, not " + std::to_string(cell_px));
  lens = camera.has_distortion();
  const double radius = lens ? camera.domain_radius() : std::numeric_limits<double>::infinity();
  domain2 = radius * radius;
  px_ideal = 1 / (camera.f * std::max(1.0, camera.s));
  cell = cell_px * px_ideal;
  lay_out();
  if (lens) tabulate();
  find_seen_tiles();
  find_seen_rectangle();
}

void SilhouetteMaker::Frame::lay_out() {
  const double w = camera.width, h = camera.height;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Eigen::Vector2d low_linear = low, high_linear = high;
  // The picture's outline; its image bounds the picture's, for the lens is one-to-one.
  constexpr int kSteps = 128;
  for (int side = 0; side < 4; ++side)
    for (int step = 0; step < kSteps; ++step) {
      const double t = double(step) / kSteps;
      const Eigen::Vector2d px = side == 0   ? Eigen::Vector2d(w * t, 0)
                                 : side == 1 ? Eigen::Vector2d(w, h * t)
                                 : side == 2 ? Eigen::Vector2d(w * (1 - t), h)
                                             : Eigen::Vector2d(0, h * (1 - t));
      Eigen::Vector2d d = camera.distorted_from_pixel(px);
      low_linear = low_linear.cwiseMin(d);
      high_linear = high_linear.cwiseMax(d);
      if (lens && d.squaredNorm() > domain2) d *= std::sqrt(domain2 / d.squaredNorm());
      if (lens) d = camera.correct(d);
      low = low.cwiseMin(d);
      high = high.cwiseMax(d);
    }
  if (lens) {
    // Between the outline's points; and never more than twice the plain picture: an extreme lens sends its corners
    // far away, and those then count as unseen.
    const Eigen::Vector2d size = high_linear - low_linear;
    low = (low - 0.01 * size).cwiseMax(low_linear - size);
    high = (high + 0.01 * size).cwiseMin(high_linear + size);
  }
  const Eigen::Vector2d cells = (high - low) / cell;
  if (!low.allFinite() || !high.allFinite() || !(cells.minCoeff() > 0) || cells.maxCoeff() > 1e6)
    throw Error(ErrorCode::degenerate, "the camera's lens or skew leaves no usable picture");
  origin = low;
  tiles_x = int(std::ceil(cells.x() / kTile - 1e-9));
  tiles_y = int(std::ceil(cells.y() / kTile - 1e-9));
  if (std::int64_t(tiles_x) * tiles_y > kMaxImagePixels / 16)
    throw Error(ErrorCode::degenerate, "the camera's lens or skew leaves no usable picture");
}

void SilhouetteMaker::Frame::tabulate() {
  const double cell_px = cell / px_ideal;
  while (stride < kTile && stride * cell_px < 12) stride *= 2;
  table_x = tiles_x * kTile / stride + 1;
  table_y = tiles_y * kTile / stride + 1;
  table.resize(std::size_t(table_x) * table_y);
  for (int y = 0; y < table_y; ++y)
    for (int x = 0; x < table_x; ++x) {
      const auto d = camera.distort(origin + cell * stride * Eigen::Vector2d(x, y));
      table[std::size_t(y) * table_x + x] =
          d ? camera.pixel_from_distorted(*d) : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    }
}

void SilhouetteMaker::Frame::find_seen_tiles() {
  seen.resize(std::size_t(tiles_x) * tiles_y);
  for (int ty = 0; ty < tiles_y; ++ty)
    for (int tx = 0; tx < tiles_x; ++tx) {
      // Without a lens the map is affine: a tile is in the picture if its corners are.
      const int step = lens ? 1 : kTile;
      int in = 0, all = 0;
      for (int y = 0; y <= kTile; y += step)
        for (int x = 0; x <= kTile; x += step, ++all) in += sees(pixel_of_sample(tx * kTile + x, ty * kTile + y));
      seen[std::size_t(ty) * tiles_x + tx] = in == all ? Seen::all : lens && in == 0 ? Seen::none : Seen::some;
    }
}

void SilhouetteMaker::Frame::find_seen_rectangle() {
  // Shrinks the worst side until none has a tile that is not wholly seen.
  int x0 = 0, y0 = 0, x1 = tiles_x - 1, y1 = tiles_y - 1;
  const auto bad = [&](int ax, int ay, int bx, int by) {
    int n = 0;
    for (int y = ay; y <= by; ++y)
      for (int x = ax; x <= bx; ++x) n += seen[std::size_t(y) * tiles_x + x] != Seen::all;
    return double(n) / ((bx - ax + 1) * (by - ay + 1));
  };
  while (x0 <= x1 && y0 <= y1) {
    const double share[4] = {bad(x0, y0, x0, y1), bad(x1, y0, x1, y1), bad(x0, y0, x1, y0), bad(x0, y1, x1, y1)};
    const auto worst = std::max_element(share, share + 4) - share;
    if (share[worst] == 0) break;
    if (worst == 0) ++x0;
    if (worst == 1) --x1;
    if (worst == 2) ++y0;
    if (worst == 3) --y1;
  }
  if (x0 > x1 || y0 > y1) return;
  seen_x0 = x0 * kTile, seen_y0 = y0 * kTile;
  seen_x1 = x1 * kTile + kTile - 1, seen_y1 = y1 * kTile + kTile - 1;
}

}  // namespace lumihull::hull
