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
  const int x0 = std::min(int(x), std::max(0, values.width() - 2)),
            y0 = std::min(int(y), std::max(0, values.height() - 2));
  const int x1 = std::min(x0 + 1, values.width() - 1), y1 = std::min(y0 + 1, values.height() - 1);
  const double fx = x - x0, fy = y - y0;
  const float *a = values.row<float>(y0), *b = values.row<float>(y1);
  return (1 - fy) * ((1 - fx) * a[x0] + fx * a[x1]) + fy * ((1 - fx) * b[x0] + fx * b[x1]);
}

// Mean of a circle's inner part: its centre and twelve places up to `radius` (a part of the semi-axes).
std::optional<double> mean_within(const Image& values, const Ellipse& e, double radius) {
  static const std::array<Vector2d, 13> places = [] {
    std::array<Vector2d, 13> p;
    for (int k = 0; k < 12; ++k) {  // six halfway out, six at the rim
      const double t = std::numbers::pi * k / 6;
      p[std::size_t(k)] = (k % 2 ? 1.0 : 0.5) * Vector2d(std::cos(t), std::sin(t));
    }
    p[12] = {0, 0};
    return p;
  }();
  const Vector2d u = radius * e.a * Vector2d(std::cos(e.angle), std::sin(e.angle));
  const Vector2d v = radius * e.b * Vector2d(-std::sin(e.angle), std::cos(e.angle));
  double sum = 0;
  for (const Vector2d& p : places) {
    const auto value = sample(values, e.center + p.x() * u + p.y() * v);
    if (!value) return std::nullopt;
    sum += *value;
  }
  return sum / double(places.size());
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
               std::span<const double> paper, double dark) {
  constexpr int kDirections = 8, kMostCircles = 25, kMostPlaces = 15;
  constexpr double kStep = 0.5;
  std::vector<double> sigmas;
  const std::size_t stride = (circles.size() + kMostCircles - 1) / kMostCircles;
  for (std::size_t i = 0; i < circles.size(); i += stride) {
    const double contrast = paper[i] * dark;
    if (states[i] != EllipseState::good || !(contrast > 0)) continue;
    const Ellipse& e = circles[i];
    const double ca = std::cos(e.angle), sa = std::sin(e.angle);
    double sum = 0;
    int n = 0;
    for (int k = 0; k < kDirections; ++k) {
      const double t = 2 * std::numbers::pi * k / kDirections, c = std::cos(t), s = std::sin(t);
      const Vector2d edge = e.center + Vector2d(e.a * c * ca - e.b * s * sa, e.a * c * sa + e.b * s * ca);
      // Across the contour: (cos t / a, sin t / b) in the ellipse's frame.
      const double nx = c / e.a, ny = s / e.b, length = std::hypot(nx, ny);
      const Vector2d normal(nx / length * ca - ny / length * sa, nx / length * sa + ny / length * ca);
      const int reach = std::min(kMostPlaces / 2, int(0.35 * std::hypot(e.a * c, e.b * s) / kStep) + 1);
      double before[2] = {0, 0}, steepest = 0;  // two steps back, one step back
      int seen = 0;
      for (int p = -reach; p <= reach; ++p) {
        const auto v = sample(values, edge + p * kStep * normal);
        if (!v) break;
        if (seen >= 2) steepest = std::max(steepest, (*v - before[0]) / (2 * kStep));
        before[0] = before[1], before[1] = *v, ++seen;
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

  const double sigma = blur_of(values, circles, states, paper, reference);
  reading.blur_px = sigma;
  for (std::size_t i = 0; i < n; ++i) {
    if (!seen[i] || states[i] != EllipseState::good) continue;
    const double x = darkness[i] / reference;
    double light = -look.light_contrast;  // what x is of a light circle
    if (!look.solid_light) {
      // Averaging is a blur, too: the places' variance along an axis is about a third of the radius squared.
      const double a = circles[i].a, b = circles[i].b, averaged = 0.29 * within * within;
      const double sx = std::sqrt(sigma * sigma / (a * a) + averaged),
                   sy = std::sqrt(sigma * sigma / (b * b) + averaged);
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
    const double dark_from = look.solid_light ? 0.5 : middle + zone,
                 light_to = look.solid_light ? 0.5 * light : middle - zone;
    if (x > dark_from && x < 1 + 0.5 * apart + 4 * noise) reading.cells[i] = Cell::dark;
    if (x < light_to && x > light - 0.6 * apart - 4 * noise) reading.cells[i] = Cell::light;
    if (reading.cells[i] != Cell::unknown)
      reading.worst = std::max(reading.worst, std::abs(x - (reading.cells[i] == Cell::dark ? 1 : light)) / apart);
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
