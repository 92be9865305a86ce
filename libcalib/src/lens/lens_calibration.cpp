// Lens calibration: start, robust refinement, what came of it.

#include <lumihull/base/error.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/lens_calibration.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "lens_checks.h"
#include "lens_start.h"

namespace lumihull::calib {
namespace {

using lens::FittedView;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Below this share of its covariance no residual is taken for an outlier: exact data leave rounding alone.
constexpr double kLeastSigma = 1e-4;
/// Normal equations (scaled) below which parameters can't be told apart; rounding leaves about 1e-13.
constexpr double kSingular = 1e-11;

void check_input(std::span<const BoardView> views, int width, int height, const LensCalibrationOptions& options) {
  options.validate();
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    throw Error(ErrorCode::invalid_argument, "width and height must be 1 … 65500 px");
  if (options.start && (options.start->width != width || options.start->height != height))
    throw Error(ErrorCode::invalid_argument, "the camera to start from is of another picture size");
  for (const BoardView& view : views)
    for (std::size_t i = 0; i < view.matches.size(); ++i) {
      const BoardMatch& m = view.matches[i];
      const auto fail = [&](const std::string& what) {
        throw Error(ErrorCode::invalid_argument, "match " + std::to_string(i) + ": " + what, view.name);
      };
      if (!m.pixel.allFinite() || !m.board.allFinite() || !m.covariance.allFinite() || !m.normal.allFinite())
        fail("pixel, board, covariance and normal must be finite");
      if (!(m.pixel.cwiseAbs().maxCoeff() < 1e7) || !(m.board.cwiseAbs().maxCoeff() < 1e9))
        fail("pixel must be below 1e7 px and board below 1e9 m");
      if (!(m.covariance(0, 0) > 0) || !(m.covariance.determinant() > 0) ||
          !(std::abs(m.covariance(0, 1) - m.covariance(1, 0)) <= 1e-9 * m.covariance.trace()))
        fail("covariance must be symmetric and positive definite");
      if (!(m.radius >= 0) || !std::isfinite(m.radius)) fail("radius must be 0 or positive");
      if (m.radius > 0 && !(m.normal.norm() > 1e-6)) fail("a circle needs the normal of its plane");
    }
}

/// |W r| of every match, infinity where it can't be projected.
std::vector<std::vector<double>> distances(const Camera& camera, const std::vector<FittedView>& views) {
  std::vector<std::vector<double>> all;
  for (const FittedView& view : views) {
    auto& own = all.emplace_back();
    for (const BoardMatch& m : view.view->matches) {
      Eigen::Vector2d pixel;
      own.push_back(lens::predict(camera, view.cam_from_board, m, &pixel)
                        ? (lens::whitening(m.covariance) * (m.pixel - pixel)).norm()
                        : kInfinity);
    }
  }
  return all;
}

/// Standard deviation by the median of all distances, of which half may be anything: that of a 2-D normal distribution
/// is sqrt(2 ln 2).
double robust_sigma(const std::vector<std::vector<double>>& all) {
  std::vector<double> d;
  for (const auto& own : all) d.insert(d.end(), own.begin(), own.end());
  const auto middle = d.begin() + std::ptrdiff_t(d.size() / 2);
  std::nth_element(d.begin(), middle, d.end());
  return std::max(kLeastSigma, *middle / std::sqrt(2 * std::numbers::ln2));
}

/// Marks matches as outliers or not; true where something changed.
bool mark(std::vector<FittedView>& views, const std::vector<std::vector<double>>& all, double limit) {
  bool changed = false;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t m = 0; m < all[i].size(); ++m) {
      const char counts = all[i][m] <= limit;
      changed = changed || counts != views[i].counts[m];
      views[i].counts[m] = counts;
    }
  return changed;
}

/// Takes out views that have too few points left.
void drop_bad_views(std::vector<FittedView>& views, std::vector<std::string>& problems) {
  std::erase_if(views, [&](const FittedView& view) {
    const auto good = std::count(view.counts.begin(), view.counts.end(), 1);
    if (good >= 4 && 2 * std::size_t(good) >= view.counts.size()) return false;
    problems.push_back("view " + view.view->name +
                       " was left out: " + std::to_string(view.counts.size() - std::size_t(good)) + " of its " +
                       std::to_string(view.counts.size()) + " points disagree with the other views");
    return true;
  });
  if (views.empty())
    throw Error(ErrorCode::degenerate, "no view is left: the points do not fit a rigid body seen by one camera");
}

double sigma0_of(const lens::LensCovariance& normal) {
  const int redundancy = 2 * normal.points - normal.unknowns;
  return redundancy > 0 ? std::sqrt(normal.chi2 / redundancy) : 0;
}

[[noreturn]] void fail_parallel() {
  throw Error(ErrorCode::degenerate,
              "all views are parallel: focal length and distance can't be told apart; tilt the target by 20 to 45 "
              "degrees in all directions");
}

[[noreturn]] void fail_weak(const lens::LensStart& start, const std::string& what) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (start.all_planar && start.views.size() > 1 && lens::largest_tilt(start.views) * kDegrees < 5) fail_parallel();
  throw Error(ErrorCode::degenerate, "the views do not determine all free parameters (" + what +
                                         "): tilt the target more, come nearer, or fix some of them");
}

/// Planes give no more equations for K than they have orientations.
void check_orientations(const lens::LensStart& start, const LensCalibrationOptions& options) {
  if (!start.all_planar) return;
  const auto wanted = std::count(options.free.begin(), options.free.begin() + 5, true);  // f, s, skew, u0, v0
  const int given = lens::plane_equations(start.views);
  if (wanted <= given) return;
  if (start.views.size() > 1 && given == 2) fail_parallel();
  throw Error(ErrorCode::degenerate,
              "too few views of a plane: they give " + std::to_string(given) + " equations for " +
                  std::to_string(wanted) +
                  " of f, s, skew, u0, v0; take 10 to 20, tilted in all directions, or fix some of these");
}

void refine(lens::LensStart& start, const LensCalibrationOptions& options, Job& job) {
  const auto run = [&](const std::array<bool, kIntrinsics>& free, double cauchy, int iterations, double tolerance) {
    lens::refine_lens(start.camera, start.views,
                      {.free = free, .cauchy = cauchy, .max_iterations = iterations, .tolerance = tolerance}, job);
  };
  const auto cauchy = [&] { return options.robust ? 2 * robust_sigma(distances(start.camera, start.views)) : 0; };
  // The closed form knows no distortion: focal length and its main term first, so that the others start near.
  std::array<bool, kIntrinsics> first{};
  for (const Intrinsic i : {Intrinsic::f, Intrinsic::k1}) first[std::size_t(i)] = options.free[std::size_t(i)];
  if (!options.start) run(first, cauchy(), std::min(8, options.max_iterations), 1e-4);
  run(options.free, cauchy(), std::min(options.robust ? 12 : options.max_iterations, options.max_iterations),
      options.robust ? 1e-5 : 1e-15);
  if (!options.robust) return;
  run(options.free, cauchy(), options.max_iterations, 1e-6);

  // Least squares over what is not an outlier, until the outliers stay the same.
  double sigma = robust_sigma(distances(start.camera, start.views));
  for (int round = 0; round < 10; ++round) {
    const bool changed = mark(start.views, distances(start.camera, start.views), options.outlier_sigma * sigma);
    drop_bad_views(start.views, start.problems);
    if (!changed && round > 0) break;
    run(options.free, 0, options.max_iterations, round < 1 ? 1e-8 : 1e-15);
    sigma = std::max(kLeastSigma, sigma0_of(lens::lens_covariance(start.camera, start.views, options.free)));
  }
  run(options.free, 0, options.max_iterations, 1e-16);
}

}  // namespace

const std::array<std::string, kIntrinsics>& intrinsic_names() {
  static const std::array<std::string, kIntrinsics> names{"f", "s", "skew", "u0", "v0", "k1", "k2", "k3", "p1", "p2"};
  return names;
}

void LensCalibrationOptions::validate() const {
  if (!(outlier_sigma >= 2 && outlier_sigma <= 1000))
    throw Error(ErrorCode::invalid_argument, "outlier_sigma must be 2 … 1000 standard deviations");
  if (max_iterations < 1 || max_iterations > 100000)
    throw Error(ErrorCode::invalid_argument, "max_iterations must be 1 … 100000");
  if (start) {
    try {
      start->validate();
    } catch (const Error& e) {
      throw Error(ErrorCode::invalid_argument, "the camera to start from: " + e.message());
    }
  }
}

LensCalibration calibrate_lens(std::span<const BoardView> views, int width, int height,
                               const LensCalibrationOptions& options, Job& job) {
  check_input(views, width, height, options);
  job.check();
  if (views.empty()) throw Error(ErrorCode::degenerate, "there is no view to calibrate from");
  lens::LensStart start = lens::start_lens(views, width, height, options);

  const auto free_count = std::count(options.free.begin(), options.free.end(), true);
  std::size_t points = 0;
  for (const FittedView& view : start.views) points += view.counts.size();
  if (2 * points < std::size_t(free_count) + 6 * start.views.size())
    throw Error(ErrorCode::degenerate, std::to_string(points) + " points in " + std::to_string(start.views.size()) +
                                           " views are too few for " + std::to_string(free_count) +
                                           " parameters and the poses: take more views, or fix some parameters");
  check_orientations(start, options);
  refine(start, options, job);
  check_orientations(start, options);

  LensCalibration result;
  result.camera = start.camera;
  try {
    result.camera.validate();
  } catch (const Error&) {
    fail_weak(start, "the refinement diverged");
  }
  const lens::LensCovariance normal = lens::lens_covariance(start.camera, start.views, options.free);
  if (!(normal.least_eigenvalue > kSingular)) fail_weak(start, "the normal equations are singular");
  result.sigma0 = sigma0_of(normal);
  result.covariance = normal.covariance * std::max(1.0, result.sigma0 * result.sigma0);
  if (const double sigma_f =
          std::sqrt(normal.covariance(0, 0)) * std::max(result.sigma0, kLeastSigma) / result.camera.f;
      !(sigma_f < 0.3))
    fail_weak(start,
              "the focal length's standard deviation is " + std::to_string(int(std::min(1e6, 100 * sigma_f))) + " %");

  result.cam_from_board.resize(views.size());
  double sum = 0;
  std::size_t counted = 0;
  for (const FittedView& view : start.views) {
    result.cam_from_board[std::size_t(view.index)] = view.cam_from_board;
    for (std::size_t m = 0; m < view.counts.size(); ++m) {
      LensCalibration::Residual residual{view.index, int(m), {0, 0}, !view.counts[m]};
      Eigen::Vector2d pixel;
      if (lens::predict(result.camera, view.cam_from_board, view.view->matches[m], &pixel))
        residual.error = view.view->matches[m].pixel - pixel;
      else
        residual.error.setConstant(std::numeric_limits<double>::quiet_NaN()), residual.outlier = true;
      if (!residual.outlier) sum += residual.error.squaredNorm(), ++counted;
      result.residuals.push_back(residual);
    }
  }
  result.rms_px = counted ? std::sqrt(sum / double(counted)) : 0;
  if (free_count > 0) lens::cross_validate(result, start.views, options.free, options.max_iterations, job);
  result.problems = std::move(start.problems);
  for (std::string& problem : lens::weak_geometry(result, views, start.views, start.all_planar, options.free))
    result.problems.push_back(std::move(problem));
  return result;
}

}  // namespace lumihull::calib
