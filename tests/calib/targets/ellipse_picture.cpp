#include "ellipse_picture.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumihull::test {
namespace {

constexpr int kSubRows = 8;  // of a row of the fine grid, each of which is covered exactly

/// Share of each cell of the fine grid that the ellipse covers.
std::vector<double> coverage(const calib::Ellipse& e, int columns, int rows, int fine) {
  std::vector<double> cover(std::size_t(columns) * rows, 0.0), change(std::size_t(columns) + 2);
  const Eigen::Matrix2d q = e.shape();
  for (int r = 0; r < rows; ++r) {
    std::fill(change.begin(), change.end(), 0.0);
    double* out = cover.data() + std::size_t(r) * columns;
    bool any = false;
    for (int s = 0; s < kSubRows; ++s) {
      const double dy = (r + (s + 0.5) / kSubRows) / fine - e.center.y(), rest = 1 - dy * dy / q(1, 1);
      if (rest <= 0) continue;
      const double middle = e.center.x() + q(0, 1) / q(1, 1) * dy;
      const double half = std::sqrt((q(0, 0) - q(0, 1) * q(0, 1) / q(1, 1)) * rest);
      // What is covered left of an end, as a running sum: a part of the cell that holds the end, then all.
      const auto edge = [&](double x, double sign) {
        const double u = std::clamp(x * fine, 0.0, double(columns));
        const int cell = int(u);
        const double part = 1 - (u - cell);
        change[std::size_t(cell)] += sign * part;
        change[std::size_t(cell) + 1] += sign * (1 - part);
      };
      edge(middle - half, 1.0 / kSubRows);
      edge(middle + half, -1.0 / kSubRows);
      any = true;
    }
    if (!any) continue;
    double sum = 0;
    for (int c = 0; c < columns; ++c) out[c] = sum += change[std::size_t(c)];
  }
  return cover;
}

std::vector<double> gaussian_taps(double sigma) {
  const int radius = std::max(1, int(std::ceil(6 * sigma)));
  std::vector<double> taps;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += taps.emplace_back(std::exp(-0.5 * i * i / (sigma * sigma)));
  for (double& t : taps) t /= sum;
  return taps;
}

}  // namespace

std::vector<double> render(const EllipseScene& scene) {
  const int fine = scene.fine, columns = scene.width * fine, rows = scene.height * fine;
  std::vector<double> grid(std::size_t(columns) * rows, scene.paper);
  for (const PaintedEllipse& e : scene.ellipses) {
    const std::vector<double> cover = coverage(e.ellipse, columns, rows, fine);
    for (std::size_t i = 0; i < grid.size(); ++i) grid[i] += cover[i] * (e.value - grid[i]);
  }
  for (const PaintedBar& b : scene.bars)
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        const auto share = [&](int i, double low, double high) {
          return std::clamp(std::min(high * fine, i + 1.0) - std::max(low * fine, double(i)), 0.0, 1.0);
        };
        double& v = grid[std::size_t(r) * columns + c];
        v += share(c, b.x0, b.x1) * share(r, b.y0, b.y1) * (b.value - v);
      }
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector2d p((c + 0.5) / fine - 0.5 * scene.width, (r + 0.5) / fine - 0.5 * scene.height);
      grid[std::size_t(r) * columns + c] *= 1 + scene.light.dot(p);
    }
  // A sampled Gaussian, then sums over each pixel: along rows, then along columns.
  const std::vector<double> taps = scene.blur_px > 0 ? gaussian_taps(scene.blur_px * fine) : std::vector<double>{1.0};
  const int radius = int(taps.size() / 2);
  // Both at once: weights of the fine cells that a pixel gathers.
  std::vector<double> gather(std::size_t(fine + 2 * radius), 0.0);
  for (int k = 0; k < fine; ++k)
    for (std::size_t i = 0; i < taps.size(); ++i) gather[std::size_t(k) + i] += taps[i] / fine;
  std::vector<double> half(std::size_t(scene.width) * rows), out(std::size_t(scene.width) * scene.height, 0.0);
  for (int r = 0; r < rows; ++r)
    for (int x = 0; x < scene.width; ++x) {
      double sum = 0;
      for (int i = 0; i < int(gather.size()); ++i)
        sum +=
            gather[std::size_t(i)] * grid[std::size_t(r) * columns + std::clamp(x * fine - radius + i, 0, columns - 1)];
      half[std::size_t(r) * scene.width + x] = sum;
    }
  for (int y = 0; y < scene.height; ++y)
    for (int i = 0; i < int(gather.size()); ++i) {
      const double* in = half.data() + std::size_t(std::clamp(y * fine - radius + i, 0, rows - 1)) * scene.width;
      for (int x = 0; x < scene.width; ++x) out[std::size_t(y) * scene.width + x] += gather[std::size_t(i)] * in[x];
    }
  return out;
}

EllipseScene scene_of(double minor_px, double aspect, double angle, double blur_px, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(-0.5, 0.5);
  EllipseScene scene;
  const double b = 0.5 * minor_px, a = b / aspect;
  const int side = int(std::ceil(2 * a + 2 * std::max(0.8 * b, 3 + 4 * blur_px) + 4)) | 1;
  scene.width = scene.height = side;
  scene.blur_px = blur_px;
  scene.fine = minor_px > 100 ? 4 : 8;
  scene.ellipses.push_back({{{0.5 * side + phase(random), 0.5 * side + phase(random)}, a, b, angle}, 0.1});
  return scene;
}

void make_ring(EllipseScene& scene, double inner_ratio) {
  calib::Ellipse inner = scene.ellipses.front().ellipse;
  inner.a *= inner_ratio;
  inner.b *= inner_ratio;
  scene.ellipses.push_back({inner, scene.paper});
}

calib::LightPlane noisy_plane(const EllipseScene& scene, const std::vector<double>& values,
                              const calib::PlaneNoise& noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  calib::LightPlane plane;
  plane.values = Image(scene.width, scene.height, 1, PixelType::f32);
  plane.noise = noise;
  for (int y = 0; y < scene.height; ++y)
    for (int x = 0; x < scene.width; ++x) {
      const double v = values[std::size_t(y) * scene.width + x];
      plane.values.row<float>(y)[x] = float(std::min(1.0, v + std::sqrt(noise.variance(v)) * normal(random)));
    }
  return plane;
}

Eigen::Matrix2d center_bound(const EllipseScene& scene, const calib::PlaneNoise& noise) {
  const std::vector<double> middle = render(scene);
  const calib::Ellipse truth = scene.ellipses.front().ellipse;
  const double bb = truth.b * truth.b, ratio = scene.ellipses.size() > 1 ? scene.ellipses[1].ellipse.b / truth.b : 0;
  const double steps[8] = {0.02, 0.02, 0.02 * bb, 0.02 * bb, 0.02 * bb, 0.01, 0.01, 0.02};
  const auto moved = [&](int k, double step) {
    EllipseScene s = scene;
    Eigen::Vector2d center = truth.center;
    Eigen::Matrix2d q = truth.shape();
    if (k < 2) center[k] += step;
    if (k == 2) q(0, 0) += step;
    if (k == 3) q(0, 1) += step, q(1, 0) += step;
    if (k == 4) q(1, 1) += step;
    if (k == 5) s.ellipses[0].value += step;
    if (k == 6) s.paper += step;
    if (k == 7) s.blur_px += step;
    s.ellipses[0].ellipse = *calib::Ellipse::from_shape(center, q);
    if (ratio > 0) {
      s.ellipses[1].ellipse = *calib::Ellipse::from_shape(center, ratio * ratio * q);
      s.ellipses[1].value = s.paper;
    }
    return render(s);
  };
  std::vector<std::vector<double>> slopes;
  for (int k = 0; k < 8; ++k) {
    std::vector<double> up = moved(k, steps[k]);
    const std::vector<double> down = moved(k, -steps[k]);
    for (std::size_t i = 0; i < up.size(); ++i) up[i] = (up[i] - down[i]) / (2 * steps[k]);
    slopes.push_back(std::move(up));
  }
  Eigen::Matrix<double, 8, 8> fisher = Eigen::Matrix<double, 8, 8>::Zero();
  for (std::size_t i = 0; i < middle.size(); ++i) {
    Eigen::Matrix<double, 8, 1> slope;
    for (std::size_t k = 0; k < 8; ++k) slope[Eigen::Index(k)] = slopes[k][i];
    fisher += slope * slope.transpose() / noise.variance(middle[i]);
  }
  return fisher.inverse().topLeftCorner<2, 2>();
}

calib::Ellipse rough_guess(const calib::Ellipse& truth, std::mt19937_64& random) {
  std::uniform_real_distribution<double> part(-1, 1);
  calib::Ellipse guess = truth;
  const double play = std::min(0.7, 0.1 * truth.b);
  guess.center += play * Eigen::Vector2d(part(random), part(random));
  guess.a += play * part(random);
  guess.b += play * part(random);
  if (guess.a < guess.b) std::swap(guess.a, guess.b);
  guess.angle += 0.1 * part(random) * (truth.a > 1.1 * truth.b ? 1 : 0);
  return guess;
}

}  // namespace lumihull::test
