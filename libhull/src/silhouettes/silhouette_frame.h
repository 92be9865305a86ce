#pragma once

// Where the samples of a camera's fields lie: the ideal plane laid out in tiles, and which of them are in the picture.

#include <lumihull/hull/silhouette.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "silhouette_data.h"

namespace lumihull::hull {

struct SilhouetteMaker::Frame {
  Frame(const Camera& camera, double cell_px);

  /// Field coordinates (cells from sample (0, 0)) of a pixel inside the lens's domain; exact.
  Eigen::Vector2d field_from_pixel(const Eigen::Vector2d& px) const {
    Eigen::Vector2d ideal = camera.distorted_from_pixel(px);
    if (lens) ideal = camera.correct(ideal);
    return (ideal - origin) / cell;
  }

  /// Pixel of a sample; NaN beyond the lens's domain. With a lens it is interpolated in a table of exact inverses
  /// (16 px apart: a few thousandths of a pixel), good enough to look a sign up.
  Eigen::Vector2d pixel_of_sample(int i, int j) const {
    if (!lens) return camera.pixel_from_distorted(origin + cell * Eigen::Vector2d(i, j));
    const int x = std::min(i / stride, table_x - 2), y = std::min(j / stride, table_y - 2);
    const double fx = double(i - x * stride) / stride, fy = double(j - y * stride) / stride;
    const Eigen::Vector2d* p = &table[std::size_t(y) * table_x + x];
    // A node beyond the domain must not spoil a sample that lies on another one.
    const auto mix = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, double f) -> Eigen::Vector2d {
      return f == 0 ? a : a + f * (b - a);
    };
    if (fy == 0) return mix(p[0], p[1], fx);
    return mix(mix(p[0], p[1], fx), mix(p[table_x], p[table_x + 1], fx), fy);
  }

  /// The box around a tile's samples in the picture. NaN where one of them lies beyond the lens's domain.
  Eigen::AlignedBox2d pixels_of_tile(int tx, int ty) const {
    // The map is affine without a lens, and bilinear between the table's nodes.
    const int step = lens ? stride : kTile;
    Eigen::AlignedBox2d box;
    for (int y = 0; y <= kTile; y += step)
      for (int x = 0; x <= kTile; x += step) box.extend(pixel_of_sample(tx * kTile + x, ty * kTile + y));
    return box;
  }

  bool sees(const Eigen::Vector2d& px) const {
    return px.x() >= 0 && px.y() >= 0 && px.x() <= camera.width && px.y() <= camera.height;
  }

  enum class Seen : std::uint8_t { all, some, none };

  Camera camera;
  bool lens = false;
  double domain2 = 0;   // squared radius of distorted coordinates where the lens is one-to-one
  double px_ideal = 0;  // one pixel in the ideal plane
  double cell = 0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  int tiles_x = 0, tiles_y = 0;
  std::vector<Seen> seen;                                    // tiles_y x tiles_x
  int seen_x0 = 0, seen_y0 = 0, seen_x1 = -1, seen_y1 = -1;  // as in Silhouette::Data

 private:
  void lay_out();
  void tabulate();
  void find_seen_tiles();
  void find_seen_rectangle();

  int stride = 1, table_x = 0, table_y = 0;
  std::vector<Eigen::Vector2d> table;
};

}  // namespace lumihull::hull
