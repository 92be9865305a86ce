// Dark or light: cells of a circle target by the light in their centres.
#include "read_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace lumihull::calib {

namespace {

using Eigen::Vector2d;

// Light at a place, bilinear; nullopt outside.
std::optional<double> sample(const Image& values, const Vector2d& p) {
  const double x = p.x() - 0.5, y = p.y() - 0.5;
  if (!(x >= 0 && y >= 0 && x <= values.width() - 1 && y <= values.height() - 1)) return std::nullopt;
  const int x0 = std::min(int(x), std::max(0, values.width() - 2)), y0 = std::min(int(y), std::max(0, values.height() - 2));
  const int x1 = std::min(x0 + 1, values.width() - 1), y1 = std::min(y0 + 1, values.height() - 1);
  const double fx = x - x0, fy = y - y0;
  const float *a = values.row<float>(y0), *b = values.row<float>(y1);
  return (1 - fy) * ((1 - fx) * a[x0] + fx * a[x1]) + fy * ((1 - fx) * b[x0] + fx * b[x1]);
}

// Mean of the places at `radius` (a part of the semi-axes) and the centre.
std::optional<double> mean_within(const Image& values, const Ellipse& e, double radius) {
  double sum = 0;
  int n = 0;
  for (int ring = 0; ring < 3; ++ring) {
    const int places = ring == 0 ? 1 : 6 * ring;
    for (int k = 0; k < places; ++k) {
      const double t = 2 * std::numbers::pi * k / places;
      const auto v = sample(values, e.center + 0.5 * ring * radius * (e.point(t) - e.center));
      if (!v) return std::nullopt;
      sum += *v;
      ++n;
    }
  }
  return sum / n;
}

// Part of a normal distribution with standard deviations sx, sy along the axes that is inside of the unit circle.
double inside_unit_circle(double sx, double sy) {
  constexpr int kSteps = 32;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = std::numbers::pi * (i + 0.5) / kSteps, c = std::cos(t) / sx, s = std::sin(t) / sy;
    const double q = c * c + s * s;
    sum += (1 - std::exp(-0.5 * q)) / q;
  }
  return std::min(1.0, sum / (kSteps * sx * sy));
}

double median(std::vector<double>& v) {
  const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

// Sigma of the picture's blur, pixels' extent included, by the steepest place across contours: contrast / (σ √2π).
double blur_of(const Image& values, std::span<const Ellipse> circles, std::span<const EllipseState> states,
               std::span<const double> paper, std::span<const double> dark) {
  constexpr int kDirections = 12;
  constexpr double kStep = 0.5;
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    if (states[i] != EllipseState::good) continue;
    const double contrast = paper[i] * dark[i];
    if (!(contrast > 0)) continue;
    double sum = 0;
    int n = 0;
    for (int k = 0; k < kDirections; ++k) {
      const Vector2d edge = circles[i].point(2 * std::numbers::pi * k / kDirections);
      const Vector2d radius = edge - circles[i].center;
      // Across the contour, not along the radius: their angle shortens steps.
      const double length = radius.norm();
      const double t = 2 * std::numbers::pi * k / kDirections;
      const Vector2d tangent = circles[i].point(t + 0.01) - circles[i].point(t - 0.01);
      Vector2d normal = Vector2d(tangent.y(), -tangent.x()).normalized();
      if (normal.dot(radius) < 0) normal = -normal;
      double steepest = 0;
      const double reach = std::min(0.35 * length, 3.0);
      for (double s = -reach; s <= reach; s += kStep) {
        const auto in = sample(values, edge + (s - kStep) * normal), out = sample(values, edge + (s + kStep) * normal);
        if (in && out) steepest = std::max(steepest, (*out - *in) / (2 * kStep));
      }
      if (steepest > 0) sum += steepest, ++n;
    }
    if (n > 0) sigmas.push_back(contrast / (sum / n * std::sqrt(2 * std::numbers::pi)));
  }
  if (sigmas.empty()) return 1;
  // Rings of small circles are shallower than discs and look more blurred: the sharper quarter counts.
  const auto quarter = sigmas.begin() + std::ptrdiff_t(sigmas.size() / 4);
  std::nth_element(sigmas.begin(), quarter, sigmas.end());
  return *quarter;
}

}  // namespace

CellReading read_cells(const LightPlane& plane, std::span<const Ellipse> circles, std::span<const EllipseState> states,
                       int columns, int certainly_dark, const CircleLook& look) {
  const Image& values = plane.values;
  const int rows = int(circles.size()) / columns;
  const std::size_t n = circles.size();
  CellReading reading;
  reading.cells.assign(n, Cell::unknown);

  // The paper about a circle: halfway along the diagonals, inside of the grid.
  std::vector<double> paper(n, 0), darkness(n, 0);
  std::vector<bool> seen(n, false);
  std::vector<double> all_dark;
  const double within = look.solid_light ? 0.5 : 0.6 * look.ring_ratio;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const std::size_t i = std::size_t(y * columns + x);
      double sum = 0;
      int count = 0;
      for (const int dy : {-1, 1})
        for (const int dx : {-1, 1}) {
          if (x + dx < 0 || x + dx >= columns || y + dy < 0 || y + dy >= rows) continue;
          const Ellipse &e = circles[i], &across = circles[std::size_t((y + dy) * columns + x + dx)];
          const auto v = sample(values, 0.5 * (e.center + across.center));
          if (v) sum += *v, ++count;
        }
      const auto inside = mean_within(values, circles[i], within);
      if (count == 0 || !inside || !(sum > 0)) continue;
      paper[i] = sum / count;
      darkness[i] = 1 - *inside / paper[i];
      seen[i] = true;
      if (states[i] == EllipseState::good) all_dark.push_back(darkness[i]);
    }
  const std::size_t certain = std::size_t(std::max(1, certainly_dark));
  if (all_dark.size() < certain) return reading;
  std::sort(all_dark.begin(), all_dark.end(), std::greater<>());
  all_dark.resize(certain);
  const double reference = median(all_dark);
  reading.contrast = reference;
  if (!(reference > 0.05)) return reading;

  std::vector<double> dark(n, reference);
  const double sigma = blur_of(values, circles, states, paper, dark);
  reading.blur_px = sigma;
  for (std::size_t i = 0; i < n; ++i) {
    if (!seen[i] || states[i] != EllipseState::good) continue;
    const double x = darkness[i] / reference;
    double light = 0;  // what x is of a light circle
    if (!look.solid_light) {
      // Averaging over a disc is a blur, too: its variance is a quarter of its radius squared.
      const double a = circles[i].a, b = circles[i].b, averaged = 0.25 * within * within;
      const double sx = std::sqrt(sigma * sigma / (a * a) + averaged), sy = std::sqrt(sigma * sigma / (b * b) + averaged);
      const double disc = inside_unit_circle(sx, sy);
      const double hole = inside_unit_circle(sx / look.ring_ratio, sy / look.ring_ratio);
      light = 1 - hole / disc;
    }
    const double apart = 1 - light, middle = 0.5 * (1 + light);
    // Noise of a centre (about three pixels' worth), of the paper's light.
    const double noise = std::sqrt(plane.noise.variance(paper[i]) / 3) / paper[i] / reference;
    if (apart < 6 * noise || apart < 0.08) continue;
    reading.separation = std::max(reading.separation, apart * reference);
    const double zone = 0.15 * apart;
    if (x > middle + zone && x < 1 + 0.5 * apart + 4 * noise) reading.cells[i] = Cell::dark;
    if (x < middle - zone && (look.solid_light || x > light - 0.6 * apart - 4 * noise)) reading.cells[i] = Cell::light;
  }
  double sum = 0, squares = 0;
  int count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (reading.cells[i] != Cell::dark) continue;
    const double x = darkness[i] / reference;
    sum += x, squares += x * x, ++count;
  }
  if (count > 1) reading.dark_spread = std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
  return reading;
}

}  // namespace lumihull::calib
