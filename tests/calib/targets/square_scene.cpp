#include "square_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace lumihull::test {
namespace {

void blur(std::vector<double>& v, int width, int height, double sigma) {
  const int radius = int(std::ceil(5.5 * sigma));
  std::vector<double> kernel;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma))), sum += kernel.back();
  for (double& k : kernel) k /= sum;
  std::vector<double> line;
  const auto pass = [&](int n, std::ptrdiff_t step, double* first) {
    line.resize(std::size_t(n));
    for (int i = 0; i < n; ++i) line[std::size_t(i)] = first[i * step];
    for (int i = 0; i < n; ++i) {
      double s = 0;
      for (int k = -radius; k <= radius; ++k)
        s += kernel[std::size_t(k + radius)] * line[std::size_t(std::clamp(i + k, 0, n - 1))];
      first[i * step] = s;
    }
  };
  for (int y = 0; y < height; ++y) pass(width, 1, v.data() + std::ptrdiff_t(y) * width);
  for (int x = 0; x < width; ++x) pass(height, width, v.data() + x);
}

}  // namespace

SquareScene::SquareScene(int width, int height, double paper, double ink)
    : width_(width), height_(height), paper_(paper), ink_(ink),
      area_(std::size_t(width * kFine + 2) * std::size_t(height * kFine + 1), 0) {}

void SquareScene::add(const calib::TargetFamily& family, int id, const Map& pixel) {
  const int grid = family.grid();
  const auto polygon = [&](double x0, double y0, double x1, double y1) {
    const Eigen::Vector2d c[4] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    std::vector<Eigen::Vector2d> points;
    const int pieces = int(8 * (x1 - x0));
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < pieces; ++i) points.push_back(pixel(c[k] + (c[(k + 1) % 4] - c[k]) * double(i) / pieces));
    return points;
  };
  add_polygon(polygon(0, 0, grid, grid));
  const auto cells = family.cells(id);
  for (int y = 0; y < grid; ++y)
    for (int x = 0; x < grid; ++x)
      if (cells[std::size_t(y * grid + x)] == calib::Cell::light) add_polygon(polygon(x, y, x + 1, y + 1), -1);
}

// Each edge adds, to the rows that it crosses, the area between it and the row's right end: the difference of it from one
// subpixel to the next is stored, so that a running sum along the row is the covered area.
void SquareScene::add_polygon(const std::vector<Eigen::Vector2d>& points, double share) {
  double orientation = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto &a = points[i], &b = points[(i + 1) % points.size()];
    orientation += a.x() * b.y() - a.y() * b.x();
  }
  const int columns = width_ * kFine, rows = height_ * kFine;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector2d a = points[i] * kFine, b = points[(i + 1) % points.size()] * kFine;
    double sign = orientation > 0 ? -share : share;
    if (a.y() > b.y()) std::swap(a, b), sign = -sign;
    if (a.y() == b.y()) continue;
    const double slope = (b.x() - a.x()) / (b.y() - a.y());
    for (int y = std::max(0, int(std::floor(a.y()))); y < std::min(rows, int(std::ceil(b.y()))); ++y) {
      const double y0 = std::max(a.y(), double(y)), y1 = std::min(b.y(), y + 1.0);
      if (y1 <= y0) continue;
      double x0 = a.x() + (y0 - a.y()) * slope, x1 = a.x() + (y1 - a.y()) * slope;
      x0 = std::clamp(x0, 0.0, double(columns)), x1 = std::clamp(x1, 0.0, double(columns));
      if (x0 > x1) std::swap(x0, x1);
      double* row = area_.data() + std::size_t(y) * std::size_t(columns + 2);
      // Covered share of subpixels left of x: in [x, x+1) of height (y1 - y0), to the right of the edge.
      const auto right_of = [&](double x) {  // area right of the edge, in columns < x, for unit height
        if (x <= x0) return 0.0;
        if (x1 - x0 < 1e-12) return x - x0;
        if (x >= x1) return x - 0.5 * (x0 + x1);
        return 0.5 * (x - x0) * (x - x0) / (x1 - x0);
      };
      double before = 0, last = 0;
      const int first = int(std::floor(x0)), end = std::min(columns, int(std::ceil(x1)) + 1);
      for (int x = first; x <= end; ++x) {
        const double covered = right_of(x + 1.0) - before;
        before += covered;
        row[x] += sign * (y1 - y0) * (covered - last);
        last = covered;
      }
    }
  }
}

Image SquareScene::photograph(const Options& options, PixelType type) const {
  const int columns = width_ * kFine, rows = height_ * kFine;
  std::vector<double> fine(std::size_t(columns) * std::size_t(rows));
  for (int y = 0; y < rows; ++y) {
    double sum = 0;
    for (int x = 0; x < columns; ++x) {
      sum += area_[std::size_t(y) * std::size_t(columns + 2) + std::size_t(x)];
      fine[std::size_t(y) * std::size_t(columns) + std::size_t(x)] = sum;
    }
  }
  if (options.blur_px > 0) blur(fine, columns, rows, options.blur_px * kFine);
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> normal;
  Image photo(width_, height_, 1, type);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      double dark = 0;
      for (int j = 0; j < kFine; ++j)
        for (int i = 0; i < kFine; ++i)
          dark += fine[std::size_t(y * kFine + j) * std::size_t(columns) + std::size_t(x * kFine + i)];
      dark /= kFine * kFine;
      const double shade = 1 + options.shade.x() * (x + 0.5) / width_ + options.shade.y() * (y + 0.5) / height_;
      double v = (paper_ + (ink_ - paper_) * dark) * shade;
      if (options.noise > 0) v += options.noise * normal(random);
      const float s = srgb_from_linear(float(std::clamp(v, 0.0, 1.0)));
      if (type == PixelType::f32)
        photo.row<float>(y)[x] = s;
      else
        photo.row<std::uint8_t>(y)[x] = std::uint8_t(std::lround(255 * s));
    }
  return photo;
}

SquareScene::Map view_of_square(int grid, double side_px, double f, double roll, double tilt, double axis,
                                const Eigen::Vector2d& middle, const Eigen::Vector2d& principal) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(axis), std::sin(axis), 0)) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const double distance = f / side_px;  // the side is 1 long
  const Eigen::Vector3d place((middle.x() - principal.x()) / f * distance, (middle.y() - principal.y()) / f * distance, distance);
  return [=](const Eigen::Vector2d& g) -> Eigen::Vector2d {
    const Eigen::Vector3d p = turn * Eigen::Vector3d(g.x() / grid - 0.5, g.y() / grid - 0.5, 0) + place;
    return Eigen::Vector2d(f * p.x() / p.z(), f * p.y() / p.z()) + principal;
  };
}

}  // namespace lumihull::test
