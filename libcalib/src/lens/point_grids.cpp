// Point grids in photographs: a start, the order of the points, and their measurement.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/ellipse.h>
#include <lumihull/calib/light_plane.h>
#include <lumihull/calib/point_grids.h>
#include <lumihull/calib/resect.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "grid_start.h"
#include "saddle_fit.h"

namespace lumihull::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

/// The points of a start by column and row.
struct Lattice {
  int columns, rows;
  std::vector<Vector2d> points;
  const Vector2d& at(int x, int y) const { return points[std::size_t(y * columns + x)]; }
};

Lattice reversed(Lattice lattice) {
  std::reverse(lattice.points.begin(), lattice.points.end());
  return lattice;
}

Lattice mirrored(Lattice lattice) {
  for (int y = 0; y < lattice.rows; ++y)
    std::reverse(lattice.points.begin() + y * lattice.columns, lattice.points.begin() + (y + 1) * lattice.columns);
  return lattice;
}

/// A quarter turn, for square lattices.
Lattice turned(const Lattice& lattice) {
  Lattice out = lattice;
  for (int y = 0; y < lattice.rows; ++y)
    for (int x = 0; x < lattice.columns; ++x)
      out.points[std::size_t(y * out.columns + x)] = lattice.at(y, lattice.rows - 1 - x);
  return out;
}

/// Twice the area of the outline, positive where rows and columns run as x and y do.
double area(const Lattice& l) {
  const std::array<Vector2d, 4> corners{l.at(0, 0), l.at(l.columns - 1, 0), l.at(l.columns - 1, l.rows - 1),
                                        l.at(0, l.rows - 1)};
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d &a = corners[i], &b = corners[(i + 1) % 4];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

double value_at(const LightPlane& plane, const Vector2d& px) {
  const int x = std::clamp(int(px.x()), 0, plane.values.width() - 1),
            y = std::clamp(int(px.y()), 0, plane.values.height() - 1);
  return plane.values.row<float>(y)[x];
}

/// Whether the field between the first four corners is darker than its neighbours: those of one colour are compared
/// with those of the other, over the whole board.
bool first_field_dark(const LightPlane& plane, const Lattice& l) {
  std::array<double, 2> sum{}, count{};
  for (int y = 0; y + 1 < l.rows; ++y)
    for (int x = 0; x + 1 < l.columns; ++x) {
      const std::size_t color = std::size_t((x + y) % 2);
      sum[color] += value_at(plane, 0.25 * (l.at(x, y) + l.at(x + 1, y) + l.at(x, y + 1) + l.at(x + 1, y + 1)));
      count[color] += 1;
    }
  return sum[0] / count[0] < sum[1] / count[1];
}

/// The numbering that the header promises.
Lattice ordered(const LightPlane& plane, const PointGrid& grid, Lattice lattice) {
  if (area(lattice) < 0) lattice = mirrored(lattice);
  std::vector<Lattice> choices{lattice, reversed(lattice)};
  if (grid.columns == grid.rows) {
    choices.push_back(turned(choices[0]));
    choices.push_back(turned(choices[1]));
  }
  if (grid.kind == PointGrid::Kind::chessboard) {
    std::vector<Lattice> dark;
    for (const Lattice& choice : choices)
      if (first_field_dark(plane, choice)) dark.push_back(choice);
    if (!dark.empty()) choices = dark;
  }
  return *std::min_element(choices.begin(), choices.end(), [](const Lattice& a, const Lattice& b) {
    return a.points.front().squaredNorm() < b.points.front().squaredNorm();
  });
}

/// Directions of the edges through a corner, and how far the nearest parallel edge is.
struct CornerFrame {
  Vector2d along_row, along_column;
  double room = 0;
};

CornerFrame frame_at(const Lattice& l, int x, int y) {
  CornerFrame frame;
  const int xa = std::max(0, x - 1), xb = std::min(l.columns - 1, x + 1), ya = std::max(0, y - 1),
            yb = std::min(l.rows - 1, y + 1);
  frame.along_row = (l.at(xb, y) - l.at(xa, y)) / (xb - xa);
  frame.along_column = (l.at(x, yb) - l.at(x, ya)) / (yb - ya);
  frame.room = 1e9;
  const auto across = [](const Vector2d& step, const Vector2d& along) {
    return std::abs(step.x() * along.y() - step.y() * along.x()) / std::max(1e-9, along.norm());
  };
  for (const int nx : {x - 1, x + 1})
    if (nx >= 0 && nx < l.columns)
      frame.room = std::min(frame.room, across(l.at(nx, y) - l.at(x, y), frame.along_column));
  for (const int ny : {y - 1, y + 1})
    if (ny >= 0 && ny < l.rows) frame.room = std::min(frame.room, across(l.at(x, ny) - l.at(x, y), frame.along_row));
  return frame;
}

std::optional<Feature> measure_corner(const LightPlane& plane, const Lattice& l, int index) {
  const int x = index % l.columns, y = index / l.columns;
  const CornerFrame frame = frame_at(l, x, y);
  // Edges are straight in the world and curved by the lens: a few px about the corner, more in large pictures.
  const double most = std::max(10.0, std::max(plane.values.width(), plane.values.height()) / 250.0);
  double radius = std::clamp(0.7 * frame.room, 3.0, most);
  auto saddle = lens::fit_saddle(plane, l.at(x, y), frame.along_row, frame.along_column, radius);
  if (!saddle) return std::nullopt;
  // Again about the crossing itself, with what blur leaves free of the neighbours' edges.
  radius = std::clamp(std::min(radius, frame.room - 2.5 * saddle->blur_px), 3.0, most);
  saddle = lens::fit_saddle(plane, saddle->pixel, frame.along_row, frame.along_column, radius);
  if (!saddle) return std::nullopt;
  return Feature{index, saddle->pixel, saddle->covariance, Matrix3d::Zero()};
}

/// Where the grid's circle number `index` is seen by a homography.
std::optional<Ellipse> predicted_ellipse(const Matrix3d& pixel_from_grid, const PointGrid& grid, int index) {
  const Eigen::Vector3d c = grid.point(index).homogeneous();
  Matrix3d dual = c * c.transpose();
  dual(0, 0) -= grid.circle_radius_m() * grid.circle_radius_m();
  dual(1, 1) -= grid.circle_radius_m() * grid.circle_radius_m();
  const Matrix3d seen = pixel_from_grid * dual * pixel_from_grid.transpose();
  if (!(std::abs(seen(2, 2)) > 0)) return std::nullopt;
  return Ellipse::from_dual_conic(seen / seen(2, 2));
}

std::optional<Feature> measure_circle(const LightPlane& plane, const Matrix3d& pixel_from_grid, const PointGrid& grid,
                                      const Vector2d& start, int index) {
  auto guess = predicted_ellipse(pixel_from_grid, grid, index);
  if (!guess) return std::nullopt;
  guess->center = start;
  const EllipseFit fit = fit_ellipse(plane, *guess);
  if (fit.state != EllipseState::good) return std::nullopt;
  const Eigen::Matrix2d covariance = fit.center_covariance();
  if (!covariance.allFinite() || !(covariance.determinant() > 0)) return std::nullopt;
  return Feature{index, fit.ellipse.center, covariance, fit.ellipse.dual_conic()};
}

/// Homography whose *predicted* centres meet the measured ones: each round corrects the points by what the circles'
/// pictures are off by.
Matrix3d homography_of(const PointGrid& grid, const std::vector<Feature>& features, double* rms_px) {
  const bool circles = grid.kind == PointGrid::Kind::circles;
  std::vector<Vector2d> plane, pixels;
  for (const Feature& f : features) plane.push_back(grid.point(f.index)), pixels.push_back(f.pixel);
  Matrix3d h = find_homography(plane, pixels);
  for (int round = 0; circles && round < 3; ++round) {
    for (std::size_t i = 0; i < features.size(); ++i)
      pixels[i] = features[i].pixel - homography_circle_center(h, plane[i], grid.circle_radius_m()) +
                  (h * plane[i].homogeneous()).hnormalized();
    h = find_homography(plane, pixels);
  }
  double sum = 0;
  for (std::size_t i = 0; i < features.size(); ++i)
    sum += ((h * plane[i].homogeneous()).hnormalized() - pixels[i]).squaredNorm();
  if (rms_px) *rms_px = std::sqrt(sum / double(features.size()));
  return h;
}

}  // namespace

std::optional<Detection> find_point_grid(const Image& photo, const PointGrid& grid, Job& job) {
  if (photo.empty()) throw Error(ErrorCode::invalid_argument, "the photograph is empty");
  if (grid.columns < 3 || grid.rows < 3 || grid.columns > 100 || grid.rows > 100)
    throw Error(ErrorCode::invalid_argument, "a point grid must have 3 … 100 columns and rows to be found");
  if (!(grid.spacing_m > 0) || !std::isfinite(grid.spacing_m) || !std::isfinite(grid.circle_diameter_m))
    throw Error(ErrorCode::invalid_argument, "a point grid needs its spacing");
  job.check();
  Lattice start{grid.columns, grid.rows, lens::grid_start(converted(photo, PixelType::u8, 1), grid)};
  if (start.points.empty()) return std::nullopt;
  const LightPlane plane = light_plane(photo, {.25f, .5f, .25f}, job);
  const Lattice lattice = ordered(plane, grid, std::move(start));
  const std::size_t n = lattice.points.size();

  std::vector<std::optional<Feature>> measured(n);
  Matrix3d by_start = Matrix3d::Identity();
  if (grid.kind == PointGrid::Kind::circles) {
    std::vector<Vector2d> all;
    for (std::size_t i = 0; i < n; ++i) all.push_back(grid.point(int(i)));
    try {
      by_start = find_homography(all, lattice.points);
    } catch (const Error&) {
      return std::nullopt;
    }
  }
  parallel_chunks(job, n, 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      measured[i] = grid.kind == PointGrid::Kind::chessboard
                        ? measure_corner(plane, lattice, int(i))
                        : measure_circle(plane, by_start, grid, lattice.points[i], int(i));
  });
  Detection found;
  found.id = -1;
  for (const auto& feature : measured)
    if (feature) found.features.push_back(*feature);
  if (3 * found.features.size() < 2 * n) return std::nullopt;
  try {
    found.pixel_from_target = homography_of(grid, found.features, &found.rms_px);
  } catch (const Error&) {
    return std::nullopt;
  }
  return found;
}

}  // namespace lumihull::calib
