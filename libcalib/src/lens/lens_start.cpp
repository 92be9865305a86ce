#include "lens_start.h"

#include <lumihull/base/error.h>
#include <lumihull/calib/resect.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "zhang.h"

namespace lumihull::calib::lens {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix34d = Eigen::Matrix<double, 3, 4>;

/// Points whose spread across their plane is less than this part of their spread in it make a homography: the direct
/// linear transform needs true depth.
constexpr double kPlanar = 0.05;

/// What one view's points map by, up to the camera's matrix: a homography of their plane, or a projection.
struct ViewMap {
  bool planar = true;
  Pose plane_from_board;     ///< planar: points are (a, b, about 0) in it
  Matrix3d homography;       ///< of (a, b)
  Matrix34d projection;      ///< of board points
  Vector3d inside{0, 0, 0};  ///< the points' mean, in the board's frame
};

Vector2d in_plane(const ViewMap& map, const Vector3d& board) { return (map.plane_from_board * board).head<2>(); }

/// Homography of points some of which may be wrong: least median of squares over minimal samples where the plain one
/// leaves a few points far from the rest, then least squares over those within reach.
Matrix3d trimmed_homography(std::span<const Vector2d> a, std::span<const Vector2d> b, bool robust) {
  const Matrix3d plain = find_homography(a, b);
  const std::size_t n = a.size();
  if (!robust || n < 8) return plain;
  std::vector<double> errors(n), sorted;
  const auto median_error = [&](const Matrix3d& h) {
    for (std::size_t i = 0; i < n; ++i) errors[i] = ((h * a[i].homogeneous()).hnormalized() - b[i]).squaredNorm();
    sorted = errors;
    for (double& e : sorted)
      if (!std::isfinite(e)) e = std::numeric_limits<double>::max();
    std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(n / 2), sorted.end());
    return sorted[n / 2];
  };
  // Distortion leaves up to about five times the median, Gaussian noise four.
  if (const double m = median_error(plain); *std::max_element(errors.begin(), errors.end()) <= 64 * m) return plain;

  Matrix3d best = plain;
  double least = median_error(plain);
  std::uint64_t state = 0x9e3779b97f4a7c15ull;  // the samples are the same in every run
  const auto next = [&](std::size_t count) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return std::size_t((state >> 33) % count);
  };
  for (int trial = 0; trial < 100; ++trial) {
    std::array<Vector2d, 4> from, to;
    std::array<std::size_t, 4> chosen{};
    for (std::size_t k = 0; k < 4; ++k) {
      do chosen[k] = next(n);
      while (std::find(chosen.begin(), chosen.begin() + std::ptrdiff_t(k), chosen[k]) !=
             chosen.begin() + std::ptrdiff_t(k));
      from[k] = a[chosen[k]];
      to[k] = b[chosen[k]];
    }
    try {
      const Matrix3d h = find_homography(from, to);
      if (const double m = median_error(h); m < least) least = m, best = h;
    } catch (const Error&) {
      continue;  // three on a line
    }
  }
  median_error(best);
  std::vector<Vector2d> from, to;
  for (std::size_t i = 0; i < n; ++i)
    if (errors[i] <= 25 * least) from.push_back(a[i]), to.push_back(b[i]);
  return find_homography(from, to);
}

/// Throws Error{degenerate} where the points allow no map.
ViewMap map_view(const BoardView& view, std::span<const Vector2d> pixels, bool robust) {
  ViewMap map;
  const auto& matches = view.matches;
  if (matches.size() < 4)
    throw Error(ErrorCode::degenerate,
                "shows " + std::to_string(matches.size()) + " points of the body, and at least 4 are needed");
  for (const BoardMatch& m : matches) map.inside += m.board;
  map.inside /= double(matches.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const BoardMatch& m : matches) spread += (m.board - map.inside) * (m.board - map.inside).transpose();
  const internal::SymmetricAxes principal = internal::symmetric_axes(spread);
  const Vector3d extent = principal.values.cwiseMax(0).cwiseSqrt();
  if (!(extent(2) > 0)) throw Error(ErrorCode::degenerate, "all its points are one point");
  if (!(extent(1) > 1e-6 * extent(2))) throw Error(ErrorCode::degenerate, "its points lie on one line");
  map.planar = extent(0) <= kPlanar * extent(2) || matches.size() < 6;
  if (map.planar) {
    Matrix3d axes;
    axes << principal.vectors.col(2), principal.vectors.col(1),
        Vector3d(principal.vectors.col(2)).cross(Vector3d(principal.vectors.col(1)));
    map.plane_from_board = Pose::from_matrix(axes.transpose(), -axes.transpose() * map.inside);
    std::vector<Vector2d> plane;
    for (const BoardMatch& m : matches) plane.push_back(in_plane(map, m.board));
    map.homography = trimmed_homography(plane, pixels, robust);
  } else {
    std::vector<Vector3d> body;
    for (const BoardMatch& m : matches) body.push_back(m.board);
    map.projection = direct_linear_transform(pixels, body);
  }
  return map;
}

std::optional<Pose> pose_of(const ViewMap& map, const Matrix3d& ray_from_pixel) {
  if (!map.planar) return pose_from_projection(ray_from_pixel * map.projection, map.inside);
  const auto pose = pose_from_homography(ray_from_pixel * map.homography, Vector2d::Zero());
  return pose ? std::optional(*pose * map.plane_from_board) : std::nullopt;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median distance (in the maps' pixels) between measured and predicted points, summed over the views; infinity where a
/// view has no pose.
double misfit(std::span<const BoardView* const> views, std::span<const ViewMap> maps,
              std::span<const std::vector<Vector2d>> pixels, const Matrix3d& k) {
  double sum = 0;
  const Matrix3d inverse = k.inverse();
  std::vector<double> errors;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto pose = pose_of(maps[i], inverse);
    if (!pose) return std::numeric_limits<double>::infinity();
    errors.clear();
    for (std::size_t m = 0; m < views[i]->matches.size(); ++m) {
      const Vector3d p = *pose * views[i]->matches[m].board;
      errors.push_back(p.z() > 0 ? ((k * p).hnormalized() - pixels[i][m]).norm() : 10);
    }
    sum += median(errors);
  }
  return sum;
}

/// The K that fits the views best, for pixels of about -1 … 1 about the picture's middle.
Matrix3d best_camera(std::span<const BoardView* const> views, std::span<const ViewMap> maps,
                     std::span<const std::vector<Vector2d>> pixels, bool free_aspect) {
  std::vector<Matrix3d> homographies, candidates;
  std::vector<double> focal;
  for (const ViewMap& map : maps) {
    if (map.planar) {
      homographies.push_back(map.homography);
    } else if (const auto k = camera_matrix_of(map.projection)) {
      candidates.push_back(*k);
      candidates.back()(0, 1) = 0;
      focal.push_back(std::sqrt((*k)(0, 0) * (*k)(1, 1)));
    }
  }
  const auto add = [&](double f) {
    Matrix3d k = Matrix3d::Identity();
    k(0, 0) = k(1, 1) = f;
    candidates.push_back(k);
  };
  if (!focal.empty()) add(median(focal));
  if (!homographies.empty())
    for (const bool center : {false, true})
      for (const bool aspect : {false, true}) {
        if (aspect && !free_aspect) continue;
        if (const auto k = zhang_camera(homographies, {.free_aspect = aspect, .free_center = center}))
          candidates.push_back(*k);
      }
  // Where closed forms fail (one view, noise, strong distortion): fields of view from 12 to 127 degrees.
  for (const double f : {0.5, 0.75, 1.1, 1.6, 2.5, 4.5, 9.0}) add(f);
  Matrix3d best = candidates.back();
  double least = std::numeric_limits<double>::infinity();
  for (const Matrix3d& k : candidates) {
    if (!(k(0, 0) > 0.1 && k(0, 0) < 200 && k(1, 1) > 0.1 && k(1, 1) < 200)) continue;
    if (const double error = misfit(views, maps, pixels, k); error < least) least = error, best = k;
  }
  return best;
}

}  // namespace

LensStart start_lens(std::span<const BoardView> views, int width, int height, const LensCalibrationOptions& options) {
  LensStart start;
  start.camera.width = width;
  start.camera.height = height;
  if (options.start) start.camera = *options.start;
  const double half = 0.5 * std::max(width, height);
  const Vector2d middle(0.5 * width, 0.5 * height);

  std::vector<const BoardView*> used;
  std::vector<ViewMap> maps;
  std::vector<std::vector<Vector2d>> pixels;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const BoardView& view = views[i];
    try {
      // With a camera to start from, `pixels` are rays (x, y, 1).
      std::vector<Vector2d> seen;
      for (const BoardMatch& m : view.matches) {
        if (!options.start) {
          seen.push_back((m.pixel - middle) / half);
        } else if (const auto ray = options.start->ray(m.pixel)) {
          seen.push_back(ray->head<2>());
        } else {
          throw Error(ErrorCode::degenerate, "has points beyond what the lens to start from can show");
        }
      }
      maps.push_back(map_view(view, seen, options.robust));
      pixels.push_back(std::move(seen));
      used.push_back(&view);
      start.views.push_back({&view, int(i), Pose{}, std::vector<char>(view.matches.size(), 1)});
    } catch (const Error& e) {
      start.problems.push_back("view " + view.name + " was left out: " + e.message());
    }
  }
  if (used.empty())
    throw Error(ErrorCode::degenerate, start.problems.empty() ? "there is no view to calibrate from"
                                                              : "no view can be used: " + start.problems.front());

  Matrix3d k = Matrix3d::Identity();
  if (!options.start) {
    k = best_camera(used, maps, pixels, options.free[std::size_t(Intrinsic::s)]);
    start.camera.f = k(1, 1) * half;
    start.camera.s = options.free[std::size_t(Intrinsic::s)] ? k(0, 0) / k(1, 1) : 1;
    // A principal point that is not to be found is in the middle.
    start.camera.u0 = middle.x() + (options.free[std::size_t(Intrinsic::u0)] ? k(0, 2) * half : 0);
    start.camera.v0 = middle.y() + (options.free[std::size_t(Intrinsic::v0)] ? k(1, 2) * half : 0);
    k << start.camera.s * start.camera.f / half, 0, (start.camera.u0 - middle.x()) / half, 0, start.camera.f / half,
        (start.camera.v0 - middle.y()) / half, 0, 0, 1;
  }
  const Matrix3d inverse = k.inverse();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    start.all_planar = start.all_planar && maps[i].planar;
    const auto pose = pose_of(maps[i], inverse);
    Vector2d ignored;
    const auto behind = [&](const BoardMatch& m) { return !predict(start.camera, *pose, m, &ignored); };
    FittedView& view = start.views[i];
    bool usable = pose.has_value();
    if (usable) {
      std::size_t lost = 0;
      for (std::size_t m = 0; m < view.counts.size(); ++m)
        if (behind(view.view->matches[m])) view.counts[m] = 0, ++lost;
      usable = 2 * lost < view.counts.size();
    }
    if (!usable) {
      start.problems.push_back("view " + view.view->name +
                               " was left out: no pose puts its points before the camera; are they the right ones?");
      continue;
    }
    view.cam_from_board = *pose;
    if (kept != i) start.views[kept] = std::move(view);
    ++kept;
  }
  start.views.resize(kept);
  if (start.views.empty()) throw Error(ErrorCode::degenerate, "no view can be used: " + start.problems.front());
  return start;
}

}  // namespace lumihull::calib::lens
