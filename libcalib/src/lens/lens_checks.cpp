#include "lens_checks.h"

#include <lumihull/internal/small_matrices.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "projection_change.h"

namespace lumihull::calib::lens {
namespace {

std::string text(const char* format, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// Normal of the plane through a view's points, in the camera's frame.
Eigen::Vector3d normal_of(const FittedView& view) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const BoardMatch& m : view.view->matches) mean += m.board;
  mean /= double(view.view->matches.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const BoardMatch& m : view.view->matches) spread += (m.board - mean) * (m.board - mean).transpose();
  return view.cam_from_board.rotation * internal::symmetric_axes(spread).vectors.col(0);
}

}  // namespace

double largest_tilt(const std::vector<FittedView>& views) {
  double least = 1;
  std::vector<Eigen::Vector3d> normals;
  for (const FittedView& view : views) normals.push_back(normal_of(view));
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) least = std::min(least, std::abs(normals[i].dot(normals[k])));
  return std::acos(std::min(1.0, least));
}

int plane_equations(const std::vector<FittedView>& views) {
  constexpr double kSame = 0.99985;  // cosine of 1 degree
  std::vector<Eigen::Vector3d> different;
  for (const FittedView& view : views) {
    const Eigen::Vector3d normal = normal_of(view);
    if (std::none_of(different.begin(), different.end(),
                     [&](const Eigen::Vector3d& other) { return std::abs(other.dot(normal)) > kSame; }))
      different.push_back(normal);
  }
  return 2 * int(different.size());
}

std::vector<std::string> weak_geometry(const LensCalibration& result, std::span<const BoardView> views,
                                       const std::vector<FittedView>& fitted, bool all_planar,
                                       const std::array<bool, kIntrinsics>& free) {
  std::vector<std::string> problems;
  const Camera& camera = result.camera;
  if (all_planar && fitted.size() < 4)
    problems.push_back("only " + std::to_string(fitted.size()) +
                       " views of a plane count: take 10 to 20, tilted by 20 to 45 degrees in all directions");
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (const double tilt = largest_tilt(fitted); all_planar && fitted.size() > 1 && tilt * kDegrees < 15)
    problems.push_back("all views are parallel to within " + text("%.0f", tilt * kDegrees) +
                       " degrees: tilt the target by 20 to 45 degrees in all directions");

  const double sigma_f = std::sqrt(result.covariance(0, 0)) / camera.f;
  if (free[0] && sigma_f > 0.01)
    problems.push_back("the focal length is known to " + text("%.1f", 100 * sigma_f) +
                       " % only: take more views, nearer ones and more tilted ones");

  // Where points were measured: cells of an 8 x 6 grid, and how far out.
  std::array<bool, 48> seen{};
  double farthest = 0, corner = 0;
  const Eigen::Vector2d center(camera.u0, camera.v0);
  for (const double x : {0.0, double(camera.width)})
    for (const double y : {0.0, double(camera.height)})
      corner = std::max(corner, (Eigen::Vector2d(x, y) - center).norm());
  for (const LensCalibration::Residual& r : result.residuals) {
    if (r.outlier) continue;
    const Eigen::Vector2d px = views[std::size_t(r.view)].matches[std::size_t(r.match)].pixel;
    farthest = std::max(farthest, (px - center).norm());
    const int x = std::clamp(int(8 * px.x() / camera.width), 0, 7),
              y = std::clamp(int(6 * px.y() / camera.height), 0, 5);
    seen[std::size_t(8 * y + x)] = true;
  }
  const double covered = double(std::count(seen.begin(), seen.end(), true)) / double(seen.size());
  const bool distortion = free[5] || free[6] || free[7] || free[8] || free[9];
  if (distortion && (farthest < 0.7 * corner || covered < 0.5))
    problems.push_back(
        "the targets cover " + text("%.0f", 100 * covered) + " % of the picture and reach " +
        text("%.0f", 100 * farthest / corner) +
        " % of the way to its corners: beyond that the lens is extrapolated; take views with the target in "
        "the corners");

  for (const FittedView& view : fitted) {
    const auto out = std::count(view.counts.begin(), view.counts.end(), 0);
    if (5 * std::size_t(out) > view.counts.size())
      problems.push_back("view " + view.view->name + ": " + std::to_string(out) + " of " +
                         std::to_string(view.counts.size()) +
                         " points are outliers; is the photograph good, the target "
                         "the right one and flat?");
  }
  if (result.sigma0 > 3)
    problems.push_back(
        "residuals are " + text("%.1f", result.sigma0) +
        " times what the points' covariances say: the target is not as it is described (flat? print scale?), "
        "the lens needs more terms, or the covariances are too small");
  if (result.cross_validation_sigma > 3)
    problems.push_back(
        "two halves of the views differ " + text("%.1f", result.cross_validation_sigma) +
        " times as much as their covariances expect: zoom, focus or target changed between views, or errors "
        "are systematic");
  return problems;
}

void cross_validate(LensCalibration& result, const std::vector<FittedView>& fitted,
                    const std::array<bool, kIntrinsics>& free, int max_iterations, const Job& job) {
  if (fitted.size() < 4) return;
  std::array<Camera, 2> cameras{result.camera, result.camera};
  Eigen::Matrix<double, kIntrinsics, kIntrinsics> covariance = decltype(covariance)::Zero();
  for (std::size_t half = 0; half < 2; ++half) {
    std::vector<FittedView> views;
    for (std::size_t i = half; i < fitted.size(); i += 2) views.push_back(fitted[i]);
    refine_lens(cameras[half], views, {.free = free, .max_iterations = max_iterations, .tolerance = 1e-10}, job);
    const LensCovariance own = lens_covariance(cameras[half], views, free);
    if (!(own.least_eigenvalue > 1e-9)) return;  // a half alone is too weak
    covariance += own.covariance;
  }
  // By the whole's sigma0, as its residuals are the better known ones.
  covariance *= result.sigma0 * result.sigma0;

  // Both halves' pixels for the rays of the whole answer; the rotation between them is least squares over the picture.
  constexpr int kColumns = 32, kRows = 24;
  const std::vector<PixelChange> changes = pixel_changes(result.camera, kColumns, kRows);
  std::vector<Eigen::Vector2d> differences;
  std::vector<Matrix23d> by_rotation;
  Eigen::Matrix3d gg = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gd = Eigen::Vector3d::Zero();
  double expected = 0;
  for (const PixelChange& change : changes) {
    if (!change.valid) continue;
    Matrix23d by_point;
    const auto a = cameras[0].project(change.ray, &by_point), b = cameras[1].project(change.ray);
    if (!a || !b) continue;
    differences.push_back(*a - *b);
    by_rotation.push_back(-by_point * cross_matrix(change.ray));
    gg += by_rotation.back().transpose() * by_rotation.back();
    gd += by_rotation.back().transpose() * differences.back();
    expected += (change.by_camera * covariance * change.by_camera.transpose()).trace();
  }
  if (differences.size() < 4) return;
  const Eigen::Vector3d rotation = gg.ldlt().solve(gd);
  double largest = 0, sum = 0;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const double d2 = (differences[i] - by_rotation[i] * rotation).squaredNorm();
    largest = std::max(largest, d2);
    sum += d2;
  }
  result.cross_validation_px = std::sqrt(largest);
  if (expected > 0) result.cross_validation_sigma = std::sqrt(sum / expected);
}

}  // namespace lumihull::calib::lens
