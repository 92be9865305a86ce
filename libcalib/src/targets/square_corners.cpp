#include "square_corners.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace lumihull::calib {
namespace {

// The sides of one square have nearly the same levels and blur: to these shares. It binds small squares, whose sides say
// little of either, and leaves large ones their own.
constexpr double kLevelTie = 0.02, kBlurTie = 0.05;

// Lines across a side that the first measurement looks at: it serves to read the cells and to know the light.
constexpr double kFirstLines = 48;

/// Where two sides meet: Newton's iteration on their parameters, from the end of one and the beginning of the other.
/// nullopt for sides that are nearly parallel, or meet far from there.
struct Corner {
  Eigen::Vector2d place{0, 0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};
std::optional<Corner> meet(const SideCurve& before, const SideCurve& after) {
  double u = 1, v = -1;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d gap = after.point(v) - before.point(u);
    Eigen::Matrix2d j;
    j.col(0) = before.along * (0.5 * before.length) + before.normal() * (before.c[1] + 2 * u * before.c[2]);
    j.col(1) = -(after.along * (0.5 * after.length) + after.normal() * (after.c[1] + 2 * v * after.c[2]));
    if (!(std::abs(j.determinant()) > 1e-3 * j.col(0).norm() * j.col(1).norm())) return std::nullopt;
    const Eigen::Vector2d step = j.inverse() * gap;
    u += step[0], v += step[1];
    if (!(std::abs(u - 1) < 0.6 && std::abs(v + 1) < 0.6)) return std::nullopt;
    if (step.norm() < 1e-12) break;
  }
  Corner corner;
  corner.place = before.point(u);
  // A corner moves so that its distance from each side's tangent is what that side moved.
  const Eigen::Vector2d t0 = before.tangent(u), t1 = after.tangent(v);
  Eigen::Matrix2d normals;
  normals << t0.y(), -t0.x(), t1.y(), -t1.x();
  const double lean0 = before.along.dot(t0), lean1 = after.along.dot(t1);  // e is measured along the chord's normal
  const Eigen::Vector2d variance(before.variance(u) * lean0 * lean0, after.variance(v) * lean1 * lean1);
  const Eigen::Matrix2d back = normals.inverse();
  corner.covariance = back * variance.asDiagonal() * back.transpose();
  if (!corner.place.allFinite() || !corner.covariance.allFinite()) return std::nullopt;
  return corner;
}

bool corners_of(const std::array<SideCurve, 4>& sides, Quad& corners, std::array<Eigen::Matrix2d, 4>* covariance) {
  for (std::size_t k = 0; k < 4; ++k) {
    const auto corner = meet(sides[(k + 3) % 4], sides[k]);
    if (!corner) return false;
    corners[k] = corner->place;
    if (covariance) (*covariance)[k] = corner->covariance;
  }
  return true;
}

/// The same curve over another chord: between new corners.
SideCurve over_chord(const SideCurve& side, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  SideCurve next = SideCurve::between(from, to);
  // A chord between two points of the curve leaves curvature alone: offset 0 at u = ±1.
  const double ratio = next.length / side.length;
  next.c = {-2.0 / 3 * side.c[2] * ratio * ratio, 0, side.c[2] * ratio * ratio};
  return next;
}

/// Means of the sides' levels and blurs, each weighted by what its fit says of itself: a plane of light over the square.
SquareLevels levels_of(const std::array<SideFit, 4>& sides, double& blur) {
  SquareLevels levels;
  for (const SideFit& s : sides) levels.middle += 0.25 * s.curve.middle;
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b(0, 0, 0);
  double dark_weight = 0, blur_weight = 0, size = 0, contrast = 0;
  blur = 0;
  for (const SideFit& s : sides) size += 0.25 * s.curve.length, contrast += 0.25 * (s.light - s.dark);
  for (const SideFit& s : sides) {
    const Eigen::Vector2d off = (s.curve.middle - levels.middle) / size;
    const Eigen::Vector3d row(1, off.x(), off.y());
    const double weight = 1 / (s.light_variance + 1e-6 * contrast * contrast);
    a += weight * row * row.transpose();
    b += weight * s.light * row;
    const double w = 1 / (s.dark_variance + 1e-6 * contrast * contrast);
    levels.dark += w * s.dark, dark_weight += w;
    const double v = 1 / (s.blur_variance + 1e-6);
    blur += v * s.blur_px, blur_weight += v;
  }
  levels.dark /= dark_weight;
  blur /= blur_weight;
  // Light that changes by more than half of itself across the square is not expected.
  a.diagonal().tail<2>().array() += 4 / (contrast * contrast);
  const Eigen::Vector3d plane = a.ldlt().solve(b);
  levels.light = plane[0];
  if (levels.light > 0) levels.slope = plane.tail<2>() / (plane[0] * size);
  if (!levels.slope.allFinite()) levels.slope.setZero();
  return levels;
}

/// What the band of side k is like, by the square's homography.
std::optional<SideBand> band_of(const Quad& corners, std::size_t k, const SideCurve& side, int grid,
                                Eigen::Matrix3d& pixel_from_grid) {
  const auto h = homography_of_square({corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4], corners[(k + 3) % 4]}, grid);
  if (!h) return std::nullopt;
  pixel_from_grid = *h;
  const auto depth = [&](double x, double y) {
    return ((*h * Eigen::Vector3d(x, y, 1)).hnormalized() - side.middle).dot(side.normal());
  };
  SideBand band;
  // The thinner end counts.
  band.module_px = std::min(-depth(0.1 * grid, 1), -depth(0.9 * grid, 1));
  band.margin_px = std::min(depth(0.1 * grid, -1), depth(0.9 * grid, -1));
  if (!(band.module_px > 0.5) || !std::isfinite(band.margin_px)) return std::nullopt;
  if (!(band.margin_px > 0.5)) band.margin_px = band.module_px;
  return band;
}

CellsBehind behind_of(const Eigen::Matrix3d& pixel_from_grid, const SideCurve& side, int grid,
                      const std::vector<Cell>& cells) {
  CellsBehind behind;
  behind.columns = grid;
  for (int row = 1; row <= 2; ++row)
    for (int x = 0; x < grid; ++x)
      if (row < grid && cells[std::size_t(row * grid + x)] == Cell::light)
        behind.light[std::size_t(row - 1)] |= std::uint64_t(1) << x;
  for (int row = 1; row <= 3; ++row)
    for (int x = 0; x <= grid; ++x) {
      const Eigen::Vector2d off = (pixel_from_grid * Eigen::Vector3d(x, row, 1)).hnormalized() - side.middle;
      behind.corners[std::size_t(row - 1)].push_back(
          {off.dot(side.along) / (0.5 * side.length), off.dot(side.normal())});
    }
  return behind;
}

std::optional<SquareMeasurement> measure(const LightPlane& plane, const std::array<SideCurve, 4>& start, int grid,
                                         const std::vector<Cell>& cells, double curvature_sd,
                                         const SquareMeasurement* first) {
  SquareMeasurement m;
  if (!corners_of(start, m.corners, nullptr)) return std::nullopt;
  std::array<SideCurve, 4> sides;
  for (std::size_t k = 0; k < 4; ++k) {
    const SideCurve chord = over_chord(start[k], m.corners[k], m.corners[(k + 1) % 4]);
    if (!(chord.length >= 6)) return std::nullopt;
    Eigen::Matrix3d pixel_from_grid;
    auto band = band_of(m.corners, k, chord, grid, pixel_from_grid);
    if (!band) return std::nullopt;
    band->curvature_sd = curvature_sd;
    band->stride = first ? 1 : std::max(1, int(chord.length / kFirstLines));
    if (first) {
      const SquareLevels& l = first->levels;
      const double shade = l.shade(chord.middle);
      band->light_slope = l.slope.dot(chord.normal()) / shade;
      band->expected = {l.dark * shade, l.light * shade, kLevelTie * (l.light - l.dark), first->blur_px,
                        kBlurTie * first->blur_px};
    }
    const auto fit = fit_side(plane, chord, *band,
                              cells.empty() ? CellsBehind{}
                                            : behind_of(pixel_from_grid, chord, grid, turned(cells, grid, int(k))));
    if (!fit) return std::nullopt;
    m.sides[k] = *fit;
    sides[k] = fit->curve;
  }
  if (!corners_of(sides, m.corners, &m.covariance)) return std::nullopt;
  m.levels = levels_of(m.sides, m.blur_px);
  return m;
}

}  // namespace

std::optional<Eigen::Matrix3d> homography_of_square(const Quad& corners, double side) {
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = corners[(k + 1) % 4] - corners[k], b = corners[(k + 2) % 4] - corners[(k + 1) % 4];
    if (!(a.x() * b.y() - a.y() * b.x() > 0.02 * a.norm() * b.norm())) return std::nullopt;
  }
  // Heckbert 1989, the square-to-quadrilateral case.
  const Eigen::Vector2d d1 = corners[1] - corners[2], d2 = corners[3] - corners[2],
                        sum = corners[0] - corners[1] + corners[2] - corners[3];
  const double det = d1.x() * d2.y() - d2.x() * d1.y();
  if (!(std::abs(det) > 0)) return std::nullopt;
  const double g = (sum.x() * d2.y() - d2.x() * sum.y()) / det, h = (d1.x() * sum.y() - sum.x() * d1.y()) / det;
  Eigen::Matrix3d m;
  m.col(0) << corners[1] - corners[0] + g * corners[1], g;
  m.col(1) << corners[3] - corners[0] + h * corners[3], h;
  m.col(2) << corners[0], 1;
  m.leftCols<2>() /= side;
  if (!m.allFinite()) return std::nullopt;
  return m;
}

std::optional<SquareMeasurement> measure_square(const LightPlane& plane, const Quad& rough, double reach_px, int grid,
                                                double curvature_sd) {
  std::array<SideCurve, 4> start;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto side =
        find_side(plane, SideCurve::between(rough[k], rough[(k + 1) % 4]), reach_px, curvature_sd);
    if (!side) return std::nullopt;
    start[k] = *side;
  }
  return measure(plane, start, grid, {}, curvature_sd, nullptr);
}

std::optional<SquareMeasurement> measure_square_again(const LightPlane& plane, const SquareMeasurement& first, int grid,
                                                      const std::vector<Cell>& cells, double curvature_sd) {
  constexpr int kRounds = 5;
  constexpr double kRest = 0.1;  // of a corner's standard deviation
  constexpr double kWideBorder = 5;  // blurs
  std::optional<SquareMeasurement> now = first;
  for (int round = 0; round < kRounds; ++round) {
    const SquareMeasurement last = *now;
    std::array<SideCurve, 4> start;
    for (std::size_t k = 0; k < 4; ++k) start[k] = last.sides[k].curve;
    now = measure(plane, start, grid, cells, curvature_sd, &last);
    if (!now) return std::nullopt;
    // Where the border is wide nothing leaks through it: there is nothing to repeat.
    double shortest = 1e300;
    for (const SideFit& side : now->sides) shortest = std::min(shortest, side.curve.length);
    if (shortest / grid > kWideBorder * now->blur_px + 1) break;
    bool rests = true;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d moved = now->corners[k] - last.corners[k];
      rests &= moved.squaredNorm() < kRest * kRest * now->covariance[k].trace();
      if (round == kRounds - 1) now->covariance[k] += moved * moved.transpose();
    }
    if (rests) break;
  }
  return now;
}

}  // namespace lumihull::calib
