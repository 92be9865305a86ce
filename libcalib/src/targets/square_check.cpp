#include "square_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lumihull::calib {
namespace {

constexpr double kInset = 0.15;  // of a cell: its rim is not looked at
constexpr int kReach = 2;        // cells that blur is followed across

double normal_cdf(double z) { return 0.5 * std::erfc(-z * 0.70710678118654752440); }

/// Value at a place by bilinear interpolation; NaN outside of the picture.
double value_at(const Image& values, const Eigen::Vector2d& p) {
  const double x = p.x() - 0.5, y = p.y() - 0.5;
  if (!(x >= 0 && y >= 0 && x <= values.width() - 1 && y <= values.height() - 1)) return std::nan("");
  const int x0 = std::min(int(x), std::max(0, values.width() - 2)), y0 = std::min(int(y), std::max(0, values.height() - 2));
  const int x1 = std::min(x0 + 1, values.width() - 1), y1 = std::min(y0 + 1, values.height() - 1);
  const double tx = x - x0, ty = y - y0;
  const float *a = values.row<float>(y0), *b = values.row<float>(y1);
  return (1 - ty) * ((1 - tx) * a[x0] + tx * a[x1]) + ty * ((1 - tx) * b[x0] + tx * b[x1]);
}

/// Weights of the cells −2 … 2 in the mean over a cell's inner part, blurred by sigma (in cells).
std::array<double, 2 * kReach + 1> blur_weights(double sigma) {
  constexpr int kPlaces = 5;
  std::array<double, 2 * kReach + 1> w{};
  for (int i = 0; i < kPlaces; ++i) {
    const double x = kInset + (1 - 2 * kInset) * (i + 0.5) / kPlaces;
    for (int k = -kReach; k <= kReach; ++k)
      w[std::size_t(k + kReach)] += (normal_cdf((k + 1 - x) / sigma) - normal_cdf((k - x) / sigma)) / kPlaces;
  }
  return w;
}

}  // namespace

std::vector<Cell> turned(const std::vector<Cell>& cells, int grid, int turns) {
  std::vector<Cell> now = cells;
  for (int t = 0; t < turns; ++t) {
    std::vector<Cell> next(now.size());
    for (int y = 0; y < grid; ++y)
      for (int x = 0; x < grid; ++x)  // counter-clockwise: the right column becomes the top row
        next[std::size_t(y * grid + x)] = now[std::size_t(x * grid + grid - 1 - y)];
    now = std::move(next);
  }
  return now;
}

SquareReading read_square(const LightPlane& plane, const Eigen::Matrix3d& pixel_from_grid, const SquareLevels& levels,
                          double blur_px, int grid, const std::vector<Cell>& cells) {
  const int wide = grid + 2;
  const auto pixel = [&](double x, double y) -> Eigen::Vector2d {
    return (pixel_from_grid * Eigen::Vector3d(x, y, 1)).hnormalized();
  };
  const double middle = 0.5 * grid;
  const double size_u = (pixel(middle + 0.5, middle) - pixel(middle - 0.5, middle)).norm(),
               size_v = (pixel(middle, middle + 0.5) - pixel(middle, middle - 0.5)).norm();
  // Blur of the lens, of a pixel, and of interpolating between pixels.
  const double blur = std::sqrt(blur_px * blur_px + 2.0 / 12);
  const auto across = blur_weights(blur / size_u), down = blur_weights(blur / size_v);

  // Paper that is clipped is seen as light as the file holds.
  const double top = std::min(levels.light, double(plane.saturation) / levels.shade(pixel(middle, middle))),
               contrast = top - levels.dark, beyond = (levels.light - levels.dark) / contrast;
  SquareReading best;
  best.rms = best.worst = 1;
  if (!(contrast > 0)) return best;
  std::vector<double> seen(std::size_t(wide * wide));
  const int places = std::clamp(int(std::ceil(std::max(size_u, size_v))), 3, 7);
  for (int y = 0; y < wide; ++y)
    for (int x = 0; x < wide; ++x) {
      double sum = 0;
      int count = 0;
      for (int j = 0; j < places; ++j)
        for (int i = 0; i < places; ++i) {
          const double u = x - 1 + kInset + (1 - 2 * kInset) * (i + 0.5) / places,
                       v = y - 1 + kInset + (1 - 2 * kInset) * (j + 0.5) / places;
          const Eigen::Vector2d p = pixel(u, v);
          const double value = value_at(plane.values, p) / levels.shade(p);
          if (!std::isfinite(value)) continue;
          sum += value, ++count;
        }
      seen[std::size_t(y * wide + x)] =
          count > 0 ? (sum / count - levels.dark) / contrast : std::nan("");
    }

  double least = 1e300;
  std::vector<double> expected(std::size_t(wide * wide)), rows(std::size_t(wide * wide));
  for (int turn = 0; turn < 4; ++turn) {
    const std::vector<Cell> now = turned(cells, grid, turn);
    const auto light = [&](int x, int y) {
      if (x < 1 || y < 1 || x > grid || y > grid) return 1.0;
      return now[std::size_t((y - 1) * grid + x - 1)] == Cell::light ? 1.0 : 0.0;
    };
    // Blur is separable: along the rows, then along the columns (paper beyond the ring).
    const auto blurred = [&](const std::array<double, 5>& w, int n, const auto& value) {
      double sum = 0;
      for (int k = -kReach; k <= kReach; ++k)
        sum += w[std::size_t(k + kReach)] * (n + k < 0 || n + k >= wide ? 1.0 : value(n + k));
      return sum + 1 - (w[0] + w[1] + w[2] + w[3] + w[4]);
    };
    for (int y = 0; y < wide; ++y)
      for (int x = 0; x < wide; ++x)
        rows[std::size_t(y * wide + x)] = blurred(across, x, [&](int i) { return light(i, y); });
    for (int y = 0; y < wide; ++y)
      for (int x = 0; x < wide; ++x)
        expected[std::size_t(y * wide + x)] = blurred(down, y, [&](int i) { return rows[std::size_t(i * wide + x)]; });

    SquareReading r;
    r.quarter_turns = turn;
    double all = 0, right = 0;
    int count = 0;
    for (int y = 0; y < wide; ++y)
      for (int x = 0; x < wide; ++x) {
        const std::size_t i = std::size_t(y * wide + x);
        const bool paper = x < 1 || y < 1 || x > grid || y > grid;
        if (paper && std::isnan(seen[i])) continue;  // beyond the picture
        const double off = std::isfinite(seen[i]) ? seen[i] - std::min(1.0, beyond * expected[i]) : 1;
        all += off * off;
        const bool data = x > 1 && y > 1 && x < grid && y < grid;
        if (data && std::abs(off) > 0.5) {
          ++r.wrong;
          continue;
        }
        right += off * off, ++count;
        r.worst = std::max(r.worst, std::abs(off));
      }
    r.rms = count > 0 ? std::sqrt(right / count) : 1;
    if (all < least) least = all, best = r;
  }
  return best;
}

}  // namespace lumihull::calib
