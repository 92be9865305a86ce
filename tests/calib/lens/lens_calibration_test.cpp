#include <lumihull/calib/lens_calibration.h>

#include <Eigen/Dense>
#include <random>
#include <set>

#include "lens/point_term.h"
#include "support.h"
#include "synthetic_views.h"

namespace lumihull::calib {
namespace {

using lens::Vector10d;
using test::make_views;
using test::ViewMaker;

constexpr std::array<bool, kIntrinsics> kNone{};

std::array<bool, kIntrinsics> all_but(std::initializer_list<Intrinsic> fixed) {
  std::array<bool, kIntrinsics> free;
  free.fill(true);
  for (const Intrinsic i : fixed) free[std::size_t(i)] = false;
  return free;
}

LensCalibration calibrate(std::span<const BoardView> views, const Camera& camera,
                          const LensCalibrationOptions& options = {}, unsigned threads = 1) {
  Job job({}, threads);
  return calibrate_lens(views, camera.width, camera.height, options, job);
}

/// Largest difference of two cameras' parameters, each over its size where that is above 1.
double parameter_difference(const Camera& a, const Camera& b) {
  const Vector10d p = lens::parameters_of(a), q = lens::parameters_of(b);
  return (p - q).cwiseQuotient(q.cwiseAbs().cwiseMax(1)).cwiseAbs().maxCoeff();
}

void expect_exact(const ViewMaker& maker, int views, std::uint64_t seed, const LensCalibrationOptions& options = {}) {
  std::vector<Pose> poses;
  const auto made = make_views(maker, views, seed, &poses);
  const LensCalibration found = calibrate(made, maker.camera, options);
  EXPECT_LT(parameter_difference(found.camera, maker.camera), 1e-8);
  EXPECT_LT(found.rms_px, 1e-7);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_TRUE(found.cam_from_board[i]);
    EXPECT_LT((found.cam_from_board[i]->matrix() - poses[i].matrix()).cwiseAbs().maxCoeff(), 1e-8);
  }
  for (const auto& residual : found.residuals) EXPECT_FALSE(residual.outlier);
}

TEST(LensCalibration, FindsTheCameraThatMadeViewsOfAPlane) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    expect_exact({.camera = test::wide_camera(), .body = test::plane_points(10, 8, 0.03)}, 10, seed);
  }
}

TEST(LensCalibration, FindsTheCameraThatMadeViewsOfASolid) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    expect_exact({.camera = test::wide_camera(), .body = test::box_points(6, 0.05), .tilt = 0.4}, 4, seed);
  }
  SCOPED_TRACE("one view");
  expect_exact({.camera = test::wide_camera(), .body = test::box_points(8, 0.05), .tilt = 0.4}, 1, 3);
}

TEST(LensCalibration, FindsTheCameraThatMadeViewsOfCircles) {
  // Radius 14 mm at 30 mm: ellipses' centres are up to 1.4 px from where the circles' centres are seen.
  expect_exact({.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .radius = 0.014}, 8, 3);
}

TEST(LensCalibration, CirclesTakenForPointsSpoilTheAnswerUnseen) {
  const ViewMaker maker{.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .radius = 0.014};
  auto views = make_views(maker, 8, 3);
  for (BoardView& view : views)
    for (BoardMatch& match : view.matches) match.radius = 0;
  const LensCalibration found = calibrate(views, maker.camera);
  // Poses and focal length take most of it up: the residuals look harmless, and the camera is wrong.
  EXPECT_LT(found.rms_px, 0.02);
  EXPECT_GT(test::largest_difference(found.camera, maker.camera), 0.3);
}

TEST(LensCalibration, AnySubsetOfTheParametersMayBeFree) {
  Camera truth = test::wide_camera();
  truth.s = 1.02;
  truth.skew = 1.5;
  truth.k3 = 0.01;
  const ViewMaker maker{.camera = truth, .body = test::plane_points(12, 12, 0.025)};
  expect_exact(maker, 15, 1, {.free = all_but({})});
  for (int i = 0; i < kIntrinsics; ++i) {
    SCOPED_TRACE(intrinsic_names()[std::size_t(i)]);
    Camera start = truth;
    expect_exact(maker, 8, 2, {.free = all_but({Intrinsic(i)}), .start = start});
    auto one = kNone;
    one[std::size_t(i)] = true;
    Vector10d p = lens::parameters_of(truth);
    p(i) += i < 2 ? 0.05 * p(i) : i < 5 ? 20 : 0.003;
    lens::set_parameters(start, p);
    expect_exact(maker, 8, 3, {.free = one, .start = start});
  }
  SCOPED_TRACE("none");
  expect_exact(maker, 3, 4, {.free = kNone, .start = truth});
}

TEST(LensCalibration, StartsFromNothingWhateverTheLens) {
  // Fields of view from 15 to 100 degrees, barrel and pincushion, points down to a handful of views.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE(trial);
    Camera truth = test::wide_camera();
    truth.f = 700 * std::pow(9.0, unit(random));
    const double corner = std::hypot(800, 600) / truth.f;  // k1 so that the corner moves by up to an eighth
    truth.k1 = (2 * unit(random) - 1) * 0.12 / (corner * corner);
    truth.k2 = (2 * unit(random) - 1) * 0.03 / std::pow(corner, 4);
    truth.u0 = 800 + 60 * (2 * unit(random) - 1);
    truth.v0 = 600 + 60 * (2 * unit(random) - 1);
    truth.p1 = truth.p2 = 0.001 * unit(random);
    const bool plane = trial % 3 != 0;
    const ViewMaker maker{.camera = truth,
                          .body = plane ? test::plane_points(9, 7, 0.03) : test::box_points(5, 0.05),
                          .tilt = plane ? 0.7 : 0.4,
                          .noise = 0.05};
    const LensCalibration found = calibrate(make_views(maker, plane ? 6 : 3, std::uint64_t(trial)), truth);
    EXPECT_NEAR(found.sigma0, 1, 0.25);
    EXPECT_LT(std::abs(found.camera.f - truth.f), 6 * std::sqrt(found.covariance(0, 0)));
  }
}

TEST(LensCalibration, CovarianceIsThatOfManyTrials) {
  const Camera truth = test::wide_camera();
  const LensCalibrationOptions options;
  std::vector<int> free;
  for (int i = 0; i < kIntrinsics; ++i)
    if (options.free[std::size_t(i)]) free.push_back(i);
  constexpr int kTrials = 200;
  double chi2 = 0, variance_ratio = 0, cross = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const ViewMaker maker{.camera = truth, .body = test::plane_points(7, 7, 0.04), .noise = 0.1};
    const LensCalibration found = calibrate(make_views(maker, 8, std::uint64_t(trial)), truth);
    const Vector10d error = lens::parameters_of(found.camera) - lens::parameters_of(truth);
    Eigen::MatrixXd covariance(free.size(), free.size());
    Eigen::VectorXd e(free.size());
    for (std::size_t i = 0; i < free.size(); ++i) {
      e(Eigen::Index(i)) = error(free[i]);
      for (std::size_t k = 0; k < free.size(); ++k)
        covariance(Eigen::Index(i), Eigen::Index(k)) = found.covariance(free[i], free[k]);
    }
    chi2 += e.dot(covariance.ldlt().solve(e)) / double(free.size()) / kTrials;
    variance_ratio += found.sigma0 * found.sigma0 / kTrials;
    cross += found.cross_validation_sigma * found.cross_validation_sigma / kTrials;
  }
  RecordProperty("chi2", std::to_string(chi2));
  EXPECT_NEAR(chi2, 1, 0.1);
  EXPECT_NEAR(variance_ratio, 1, 0.01);
  EXPECT_NEAR(cross, 1, 0.2);
}

TEST(LensCalibration, UncertaintyOfPixelsIsThatOfManyTrials) {
  const Camera truth = test::wide_camera();
  const ViewMaker maker{.camera = truth, .body = test::plane_points(7, 7, 0.04), .noise = 0.1};
  constexpr int kColumns = 8, kRows = 6, kTrials = 60;
  double ratio = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const LensCalibration found = calibrate(make_views(maker, 8, std::uint64_t(trial)), truth);
    const auto sigma = projection_uncertainty(found, kColumns, kRows);
    // The rotation that takes most of the difference from the truth off, one Gauss-Newton step: it is small.
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector2d> difference;
    std::vector<Matrix23d> turn;
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Eigen::Vector2d px(1600 * (i % kColumns + 0.5) / kColumns, 1200 * (i / kColumns + 0.5) / kRows);
      const Eigen::Vector3d ray = *truth.ray(px);
      Matrix23d by_point;
      difference.push_back(*found.camera.project(ray, &by_point) - px);
      turn.push_back(-by_point * lens::cross_matrix(ray));
      normal += turn.back().transpose() * turn.back();
      right += turn.back().transpose() * difference.back();
    }
    const Eigen::Vector3d rotation = normal.ldlt().solve(right);
    double expected = 0, seen = 0;
    for (std::size_t i = 0; i < difference.size(); ++i) {
      seen += (difference[i] - turn[i] * rotation).squaredNorm();
      expected += sigma[i] * sigma[i];
    }
    ratio += seen / expected / kTrials;
  }
  // The larger axis alone: between half and all of the squared distance.
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 2.1);
}

TEST(LensCalibration, WrongPointsAreNamedAndDoNoHarm) {
  const Camera truth = test::wide_camera();
  const ViewMaker maker{.camera = truth, .body = test::plane_points(9, 7, 0.03), .noise = 0.1};
  auto views = make_views(maker, 10, 11);
  const LensCalibration clean = calibrate(views, truth);
  std::mt19937_64 random(3);
  std::set<std::pair<int, int>> wrong;
  for (int i = 0; i < 30; ++i) {
    const std::size_t v = random() % views.size(), m = random() % views[v].matches.size();
    if (!wrong.insert({int(v), int(m)}).second) continue;
    const double angle = double(random() % 628) / 100, size = 1.5 * std::pow(100.0, double(random() % 100) / 100);
    views[v].matches[m].pixel += size * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  const LensCalibration found = calibrate(views, truth);
  std::size_t named = 0, innocent = 0;
  for (const auto& r : found.residuals)
    if (r.outlier) ++(wrong.count({r.view, r.match}) ? named : innocent);
  EXPECT_EQ(named, wrong.size());
  EXPECT_LE(innocent, 3u);
  const Vector10d moved = lens::parameters_of(found.camera) - lens::parameters_of(clean.camera);
  for (int i = 0; i < kIntrinsics; ++i)
    EXPECT_LE(std::abs(moved(i)), 0.6 * std::sqrt(clean.covariance(i, i))) << intrinsic_names()[std::size_t(i)];
  EXPECT_NEAR(found.sigma0, clean.sigma0, 0.02);
}

TEST(LensCalibration, AViewOfSomethingElseIsLeftOut) {
  const Camera truth = test::wide_camera();
  const ViewMaker maker{.camera = truth, .body = test::plane_points(9, 7, 0.03), .noise = 0.1};
  auto views = make_views(maker, 10, 12);
  std::mt19937_64 random(4);
  for (BoardMatch& match : views[4].matches) match.pixel = {double(random() % 1600), double(random() % 1200)};
  const LensCalibration found = calibrate(views, truth);
  EXPECT_FALSE(found.cam_from_board[4]);
  ASSERT_FALSE(found.problems.empty());
  EXPECT_THAT(found.problems.front(), testing::HasSubstr("view view4 was left out"));
  EXPECT_LT(std::abs(found.camera.f - truth.f), 5 * std::sqrt(found.covariance(0, 0)));
}

TEST(LensCalibration, DoesNotDependOnThreads) {
  const ViewMaker maker{.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .noise = 0.1};
  const auto views = make_views(maker, 8, 13);
  const LensCalibration one = calibrate(views, maker.camera, {}, 1), four = calibrate(views, maker.camera, {}, 4);
  EXPECT_EQ(lens::parameters_of(one.camera), lens::parameters_of(four.camera));
  EXPECT_EQ(one.covariance, four.covariance);
}

TEST(LensCalibration, DerivativesOfAPointAreThoseOfDifferences) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE(trial);
    Camera camera = test::wide_camera();
    camera.s = 1.1, camera.skew = 3, camera.k3 = 0.01;
    BoardMatch match;
    match.board = {0.2 * unit(random), 0.2 * unit(random), 0.05 * unit(random)};
    if (trial % 2) match.radius = 0.008;
    const Pose pose{Eigen::Quaterniond(1, 0.3 * unit(random), 0.3 * unit(random), unit(random)).normalized(),
                    {0.1 * unit(random), 0.1 * unit(random), 0.8}};
    Eigen::Vector2d pixel, plus, minus;
    lens::Matrix2x10d by_camera;
    lens::Matrix26d by_pose;
    ASSERT_TRUE(lens::predict(camera, pose, match, &pixel, &by_camera, &by_pose));
    // Circles': but for a part of their offset's change.
    const double tolerance = match.radius > 0 ? 2e-3 : 1e-6;
    for (int i = 0; i < kIntrinsics; ++i) {
      const Vector10d p = lens::parameters_of(camera);
      const double h = i < 5 && i != 1 ? 1e-3 : 1e-6;
      Camera a = camera, b = camera;
      lens::set_parameters(a, p + h * Vector10d::Unit(i));
      lens::set_parameters(b, p - h * Vector10d::Unit(i));
      ASSERT_TRUE(lens::predict(a, pose, match, &plus) && lens::predict(b, pose, match, &minus));
      const Eigen::Vector2d slope = (plus - minus) / (2 * h);
      EXPECT_LT((slope - by_camera.col(i)).norm(), tolerance * std::max(1.0, slope.norm())) << i;
    }
    for (int i = 0; i < 6; ++i) {
      const Eigen::Matrix<double, 6, 1> step = 1e-6 * Eigen::Matrix<double, 6, 1>::Unit(i);
      ASSERT_TRUE(lens::predict(camera, lens::moved(pose, step), match, &plus) &&
                  lens::predict(camera, lens::moved(pose, -step), match, &minus));
      const Eigen::Vector2d slope = (plus - minus) / 2e-6;
      EXPECT_LT((slope - by_pose.col(i)).norm(), tolerance * std::max(1.0, slope.norm())) << i;
    }
  }
}

}  // namespace
}  // namespace lumihull::calib
