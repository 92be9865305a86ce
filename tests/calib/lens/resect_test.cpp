#include <lumihull/calib/resect.h>

#include <Eigen/Dense>

#include "resect_scenes.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::resect_scene;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

ErrorCode code_of(const Camera& camera, const std::vector<PointMatch>& matches, const ResectOptions& options = {}) {
  return test::expect_error([&] { resect(camera, matches, options); }).code();
}

TEST(Resect, RecoversThePoseThatMadeThePixels) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    const bool planar = seed % 2;
    const int points = std::array{4, 5, 6, 7, 12, 200}[seed / 2 % 6];
    const bool circles = seed % 5 == 0;
    const auto scene =
        resect_scene(seed, {.points = points, .planar = planar, .distorted = seed % 3 != 0, .circles = circles});
    for (const bool robust : {false, true}) {
      const Resection r = resect(scene.camera, scene.matches, {.robust = robust});
      EXPECT_LT(test::angle_between(r.cam_from_world, scene.cam_from_world), 1e-9)
          << points << planar << circles << robust;
      EXPECT_LT((r.cam_from_world.center() - scene.cam_from_world.center()).norm(), 1e-8);
      EXPECT_TRUE(r.outliers.empty());
      EXPECT_LT(r.rms_px, 1e-6);
    }
  }
}

TEST(Resect, AnyUnitAndAnyOrigin) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const double size = std::array{1e-3, 1.0, 1e3, 1e6}[seed % 4];
    const auto scene = resect_scene(seed, {.points = 30,
                                           .planar = seed % 3 == 0,
                                           .noise_px = 0.05,
                                           .size_m = size,
                                           .at = size * Vector3d(8000, -5000, 3000)});
    const Resection r = resect(scene.camera, scene.matches);
    const Vector6 motion = test::motion_between(r.cam_from_world, scene.cam_from_world);
    const Vector6 solved = r.covariance.ldlt().solve(motion);
    EXPECT_LT(motion.dot(solved), 35) << "of chi-square with 6 degrees of freedom";
    EXPECT_TRUE(r.outliers.empty());
  }
}

TEST(Resect, ReachesTheBoundAndKnowsItsCovariance) {
  // Mean Mahalanobis² of the pose over many draws: 6. The bound is the inverse of the Fisher information at the truth,
  // which is what the covariance is; errors in its metric are therefore those over the bound.
  for (const bool planar : {false, true})
    for (const int points : {8, 40, 200}) {
      double sum = 0, sigma = 0;
      constexpr int kDraws = 1000;
      for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
        const auto scene =
            resect_scene(seed, {.points = points, .planar = planar, .circles = points == 40, .noise_px = 0.1});
        const Resection r = resect(scene.camera, scene.matches, {.robust = points > 8});
        const Vector6 motion = test::motion_between(r.cam_from_world, scene.cam_from_world);
        sum += motion.dot(r.covariance.ldlt().solve(motion)) / kDraws;
        sigma += r.sigma0 * r.sigma0 / kDraws;
      }
      SCOPED_TRACE((planar ? "planar " : "space ") + std::to_string(points));
      RecordProperty((planar ? "planar_" : "space_") + std::to_string(points),
                     std::to_string(sum) + " " + std::to_string(sigma));
      EXPECT_NEAR(sum, 6, 0.3);
      EXPECT_NEAR(sigma, 1, 0.05);
    }
}

TEST(Resect, NamesWrongMatches) {
  int wrong = 0, named = 0, false_names = 0, right = 0;
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE(seed);
    const int points = std::array{12, 30, 200, 1000}[seed % 4];
    const auto scene = resect_scene(seed, {.points = points,
                                           .planar = seed % 3 == 0,
                                           .circles = seed % 5 == 0,
                                           .noise_px = 0.1,
                                           .wrong_share = points == 12 ? 0.25 : 0.4,
                                           .wrong_px = seed % 7 ? 500.0 : 20.0});
    const Resection r = resect(scene.camera, scene.matches);
    const Vector6 motion = test::motion_between(r.cam_from_world, scene.cam_from_world);
    EXPECT_LT(motion.dot(r.covariance.ldlt().solve(motion)), 40);
    for (const std::uint32_t i : r.outliers)
      (std::binary_search(scene.wrong.begin(), scene.wrong.end(), i) ? named : false_names) += 1;
    EXPECT_TRUE(std::includes(r.outliers.begin(), r.outliers.end(), scene.wrong.begin(), scene.wrong.end()));
    wrong += int(scene.wrong.size());
    right += points - int(scene.wrong.size());
  }
  EXPECT_EQ(named, wrong);
  EXPECT_LT(false_names, 0.002 * right);
}

TEST(Resect, MoreWrongThanRight) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const auto scene = resect_scene(
        seed, {.points = 100, .planar = seed % 2 == 1, .noise_px = 0.1, .wrong_share = 0.75, .wrong_px = 1500});
    const Resection r = resect(scene.camera, scene.matches);
    EXPECT_LT(test::angle_between(r.cam_from_world, scene.cam_from_world), 1e-3);
    EXPECT_TRUE(std::includes(r.outliers.begin(), r.outliers.end(), scene.wrong.begin(), scene.wrong.end()));
  }
}

TEST(Resect, FewNamesWithoutReason) {
  int false_names = 0, matches = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    const int points = std::array{5, 6, 8, 12, 30, 200}[seed % 6];
    const auto scene = resect_scene(seed, {.points = points, .planar = seed % 4 < 2, .noise_px = 0.1});
    const Resection r = resect(scene.camera, scene.matches);
    false_names += int(r.outliers.size());
    matches += points;
    EXPECT_LT(test::angle_between(r.cam_from_world, scene.cam_from_world), 0.01) << seed;
  }
  EXPECT_LT(false_names, 0.002 * matches);
}

TEST(Resect, CovariancesMayBeRelative) {
  // Noise of 0.05 px, covariances left at 1 px²: wrong matches of 2 px are still seen.
  auto scene = resect_scene(3, {.points = 60, .noise_px = 0.05});
  for (PointMatch& m : scene.matches) m.covariance.setIdentity();
  scene.matches[17].pixel += Vector2d(2, 0);
  scene.matches[40].pixel += Vector2d(0, -3);
  const Resection r = resect(scene.camera, scene.matches);
  EXPECT_THAT(r.outliers, testing::ElementsAre(17u, 40u));
  EXPECT_NEAR(r.sigma0, 0.05, 0.01);
}

TEST(Resect, TheOrderOfMatchesDoesNotMatter) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    auto scene = resect_scene(
        seed, {.points = 40, .planar = seed % 2 == 1, .noise_px = 0.1, .wrong_share = seed % 4 < 2 ? 0.3 : 0});
    const Resection a = resect(scene.camera, scene.matches);
    std::reverse(scene.matches.begin(), scene.matches.end());
    const Resection b = resect(scene.camera, scene.matches);
    EXPECT_LT(test::angle_between(a.cam_from_world, b.cam_from_world), 1e-8);
    EXPECT_EQ(a.outliers.size(), b.outliers.size());
    const Resection again = resect(scene.camera, scene.matches);
    EXPECT_EQ(again.cam_from_world.matrix(), b.cam_from_world.matrix()) << "same input, same bits";
  }
}

TEST(Resect, TheWorldMayBeMoved) {
  const auto scene = resect_scene(11, {.points = 30, .circles = true, .noise_px = 0.1});
  const Pose moved_from_world{Eigen::Quaterniond(0.3, 0.5, -0.4, 0.7).normalized(), {3, -2, 5}};
  auto moved = scene;
  for (PointMatch& m : moved.matches)
    m.world = moved_from_world * m.world, m.normal = moved_from_world.rotation * m.normal;
  const Resection a = resect(scene.camera, scene.matches), b = resect(scene.camera, moved.matches);
  EXPECT_LT(test::motion_between(a.cam_from_world, b.cam_from_world * moved_from_world).norm(), 1e-8);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * a.covariance.norm());
}

TEST(Resect, ASmallPlaneFarAwayHasTwoTilts) {
  // A square of 20 px: noise hides the perspective that tells the tilts apart.
  int alternatives = 0, either = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto scene =
        resect_scene(seed, {.points = 4, .planar = true, .noise_px = 0.1, .size_m = 0.05, .distance = 150});
    const Resection r = resect(scene.camera, scene.matches);
    const auto off = [&](const Pose& p) {
      const Vector6 motion = test::motion_between(p, scene.cam_from_world);
      return motion.head<3>().norm();
    };
    alternatives += r.alternative.has_value();
    const double nearest = r.alternative ? std::min(off(r.cam_from_world), off(*r.alternative)) : off(r.cam_from_world);
    either += nearest < 0.3;
    if (r.alternative) {
      EXPECT_GE(r.alternative_chi2_ratio, 1);
    }
  }
  EXPECT_GT(alternatives, 70);
  EXPECT_GE(either, 95);
  // The same square near the camera: no doubt.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto scene = resect_scene(seed, {.points = 25, .planar = true, .noise_px = 0.1});
    const Resection r = resect(scene.camera, scene.matches);
    EXPECT_FALSE(r.alternative) << seed;
  }
}

TEST(Resect, NamesWhatCannotBe) {
  const auto scene = resect_scene(1, {.points = 20});
  const Camera& camera = scene.camera;
  const auto with = [&](auto change) {
    auto matches = scene.matches;
    change(matches);
    return code_of(camera, matches);
  };
  using Matches = std::vector<PointMatch>;
  EXPECT_EQ(with([](Matches& m) { m.clear(); }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m.resize(3); }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].pixel.x() = std::nan(""); }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].world.z() = INFINITY; }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].world.z() = 1e300; }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].covariance.setZero(); }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].covariance << 1, 2, 2, 1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].radius = -1; }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m[7].radius = 1, m[7].normal.setZero(); }), ErrorCode::invalid_argument);
  EXPECT_EQ(with([](Matches& m) { m.assign(10, m[0]); }), ErrorCode::degenerate) << "one point ten times";
  EXPECT_EQ(with([](Matches& m) { m.resize(3), m.push_back(m[0]), m.push_back(m[1]); }), ErrorCode::degenerate);
  EXPECT_EQ(code_of(camera, scene.matches, {.outlier_sigma = 0}), ErrorCode::invalid_argument);
  EXPECT_EQ(code_of(camera, scene.matches, {.max_iterations = 0}), ErrorCode::invalid_argument);
  for (const bool robust : {false, true}) {
    SCOPED_TRACE(robust);
    Matches line;
    for (int i = 0; i < 8; ++i) {
      PointMatch m;
      m.world = Vector3d(1e3, 2e3, 0) + i * Vector3d(0.3, 0.1, -0.2);
      m.pixel = *camera.project(Vector3d(0.1, -0.2, 4) + i * Vector3d(0.3, 0.1, -0.2));
      line.push_back(m);
    }
    EXPECT_EQ(code_of(camera, line, {.robust = robust}), ErrorCode::degenerate);
    // Points behind the camera: a pinhole's equations would take them.
    Matches behind = scene.matches;
    const Pose back = Pose{Eigen::Quaterniond(0, 0, 1, 0), {0, 0, 0}} * scene.cam_from_world;
    Camera pinhole = camera;
    pinhole.k1 = pinhole.k2 = pinhole.p1 = pinhole.p2 = 0;
    for (PointMatch& m : behind) m.pixel = (pinhole.matrix() * (back * m.world)).hnormalized();
    const Error error = test::expect_error([&] { resect(pinhole, behind, {.robust = robust}); });
    EXPECT_EQ(error.code(), ErrorCode::degenerate);
    EXPECT_THAT(error.message(), testing::HasSubstr("behind"));
    // Pixels that have nothing to do with the points.
    Matches noise = scene.matches;
    std::mt19937_64 random(3);
    for (PointMatch& m : noise) m.pixel = {double(random() % 3000), double(random() % 2000)};
    EXPECT_EQ(code_of(camera, noise, {.robust = robust}), ErrorCode::degenerate);
    Matches one_place = scene.matches;
    for (PointMatch& m : one_place) m.pixel = {1500, 1000};
    EXPECT_EQ(code_of(camera, one_place, {.robust = robust}), ErrorCode::degenerate);
  }
  Camera bad = camera;
  bad.f = 0;
  EXPECT_EQ(code_of(bad, scene.matches), ErrorCode::bad_input);
}

TEST(Resect, PixelsBeyondTheLensAreNamed) {
  auto scene = resect_scene(5, {.points = 20, .distorted = false, .noise_px = 0.1});
  scene.camera.k1 = -0.2;
  for (PointMatch& m : scene.matches) m.pixel = *scene.camera.project(scene.cam_from_world * m.world);
  scene.matches[3].pixel = {1e6, 0};
  EXPECT_THAT(resect(scene.camera, scene.matches).outliers, testing::ElementsAre(3u));
  EXPECT_EQ(code_of(scene.camera, scene.matches, {.robust = false}), ErrorCode::degenerate);
}

TEST(Resect, ManyPointsOnALineAndOneBesideIt) {
  // No homography, no camera matrix; but a pose.
  auto scene = resect_scene(8, {.points = 12});
  for (int i = 0; i < 11; ++i)
    scene.matches[std::size_t(i)].world =
        scene.matches[0].world +
        i * 0.05 * (scene.matches[11].world - scene.matches[10].world + Vector3d(0.1, 0.5, 0.2));
  for (PointMatch& m : scene.matches) m.pixel = *scene.camera.project(scene.cam_from_world * m.world);
  const Resection r = resect(scene.camera, scene.matches);
  EXPECT_LT(test::angle_between(r.cam_from_world, scene.cam_from_world), 1e-8);
}

TEST(DirectLinearTransform, FindsTheCameraMatrix) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    const auto scene = resect_scene(seed, {.points = 6 + int(seed), .distorted = false, .at = {100, 200, -50}});
    std::vector<Vector2d> pixels;
    std::vector<Vector3d> world;
    for (const PointMatch& m : scene.matches) pixels.push_back(m.pixel), world.push_back(m.world);
    const auto m = direct_linear_transform(pixels, world);
    const Eigen::Matrix<double, 3, 4> truth = scene.camera.matrix() * scene.cam_from_world.matrix();
    EXPECT_LT((m - truth).norm(), 1e-6 * truth.norm());
  }
  const auto scene = resect_scene(1, {.points = 8, .planar = true});
  std::vector<Vector2d> pixels;
  std::vector<Vector3d> world;
  for (const PointMatch& m : scene.matches) pixels.push_back(m.pixel), world.push_back(m.world);
  EXPECT_EQ(test::expect_error([&] { direct_linear_transform(pixels, world); }).code(), ErrorCode::degenerate);
  pixels.pop_back();
  EXPECT_EQ(test::expect_error([&] { direct_linear_transform(pixels, world); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
