#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "support.h"

namespace lumihull::calib {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct Scene {
  Camera camera;
  Circle3 circle;
};

/// A circle of about `radius_px` somewhere in the picture, tilted up to `tilt_degrees` from facing the camera.
Scene random_scene(std::uint64_t seed, bool distorted, double radius_px, double tilt_degrees) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Scene scene;
  Camera& c = scene.camera = {.width = 3072, .height = 2048};
  c.f = uniform(1800, 4000), c.s = uniform(0.9, 1.1), c.skew = uniform(-20, 20), c.u0 = uniform(1400, 1700);
  c.v0 = uniform(900, 1100);
  if (distorted)
    c.k1 = uniform(-0.1, 0.15), c.k2 = uniform(-0.03, 0.03), c.k3 = uniform(-0.005, 0.005),
    c.p1 = uniform(-0.002, 0.002), c.p2 = uniform(-0.002, 0.002);
  Circle3& k = scene.circle;
  std::optional<Vector3d> ray;
  while (!ray) ray = c.ray({uniform(100, 2900), uniform(100, 1900)});
  k.center = uniform(0.5, 3) * *ray;
  k.radius = radius_px * k.center.z() / c.f;
  const Vector3d facing = -k.center.normalized();
  const double tilt = tilt_degrees * std::numbers::pi / 180 * std::sqrt(uniform(0, 1));
  const Vector3d side = Eigen::AngleAxisd(uniform(0, 6.3), facing) * facing.unitOrthogonal();
  const Vector3d normal = Eigen::AngleAxisd(tilt, side) * facing;
  k.u = Eigen::AngleAxisd(uniform(0, 6.3), normal) * normal.unitOrthogonal();
  k.v = normal.cross(k.u);
  return scene;
}

/// The same by brute force: 2000 places of the contour by `Camera::project`, and the ellipse that minimises the squared
/// distances by arc length, with orthogonal foot points found to the last digit.
Vector2d brute_force(const Scene& scene) {
  constexpr int kPlaces = 2000;
  std::vector<Vector2d> p;
  for (int i = 0; i < kPlaces; ++i) {
    const double t = 2 * std::numbers::pi * i / kPlaces;
    p.push_back(*scene.camera.project(
        scene.circle.center + scene.circle.radius * (std::cos(t) * scene.circle.u + std::sin(t) * scene.circle.v)));
  }
  Vector2d center = Vector2d::Zero();
  for (const Vector2d& q : p) center += q / kPlaces;
  Matrix2d shape = Matrix2d::Zero();  // of points E = {shape z, |z| = 1}
  for (const Vector2d& q : p) shape += 2 * (q - center) * (q - center).transpose() / kPlaces;
  Eigen::SelfAdjointEigenSolver<Matrix2d> root(shape);
  shape = root.operatorSqrt();
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::SelfAdjointEigenSolver<Matrix2d> axes(shape * shape.transpose());
    const double a2 = axes.eigenvalues()[1], b2 = axes.eigenvalues()[0];
    Matrix2d turn;
    turn << axes.eigenvectors().col(1), axes.eigenvectors().col(0);
    Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
    for (int i = 0; i < kPlaces; ++i) {
      const double weight = (p[std::size_t(i + 1) % kPlaces] - p[std::size_t(i + kPlaces - 1) % kPlaces]).norm();
      const Vector2d y = turn.transpose() * (p[std::size_t(i)] - center);
      // Foot point (a² y0 / (a² + s), b² y1 / (b² + s)): Newton on s.
      double s = 0;
      for (int k = 0; k < 30; ++k) {
        const double u = y.x() / (a2 + s), v = y.y() / (b2 + s);
        s += (a2 * u * u + b2 * v * v - 1) / (2 * (a2 * u * u / (a2 + s) + b2 * v * v / (b2 + s)));
      }
      const Vector2d foot(a2 * y.x() / (a2 + s), b2 * y.y() / (b2 + s));
      const Vector2d n = turn * Vector2d(foot.x() / a2, foot.y() / b2).normalized(), f = turn * foot;
      const double r = n.dot(turn * (y - foot));
      Eigen::Matrix<double, 5, 1> row;
      row << n.x(), n.y(), n.x() * f.x(), n.y() * f.y(), n.x() * f.y() + n.y() * f.x();
      normal += weight * row * row.transpose();
      right += weight * r * row;
    }
    const Eigen::Matrix<double, 5, 1> step = normal.ldlt().solve(right);
    center += step.head<2>();
    Matrix2d strain;
    strain << step[2], step[4], step[4], step[3];
    shape += strain * shape;
    if (step.norm() < 1e-11) break;
  }
  return center;
}

TEST(CircleProjection, WithoutDistortionItIsTheDualConicsCentre) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    const auto [camera, k] = random_scene(seed, false, 80, 75);
    const Matrix3d dual =
        k.center * k.center.transpose() - k.radius * k.radius * (k.u * k.u.transpose() + k.v * k.v.transpose());
    const Vector3d column = camera.matrix() * dual * camera.matrix().row(2).transpose();
    const auto center = projected_circle_center(camera, k);
    ASSERT_TRUE(center);
    EXPECT_LT((*center - column.hnormalized()).norm(), 1e-9);
    // The plane's door: H = K [u v X].
    Matrix3d h;
    h << k.u, k.v, k.center;
    EXPECT_LT((homography_circle_center(camera.matrix() * h, {0, 0}, k.radius) - *center).norm(), 1e-9);
    const Vector2d at(0.3, -0.2);
    h.col(2) -= h * Vector3d(at.x(), at.y(), 0);
    EXPECT_LT((homography_circle_center(camera.matrix() * h, at, k.radius) - *center).norm(), 1e-9);
    // A lens that distorts by less than rounding takes the general path.
    Camera nearly = camera;
    nearly.k1 = 1e-15;
    EXPECT_LT((*projected_circle_center(nearly, k) - *center).norm(), 1e-8);
  }
}

TEST(CircleProjection, ThroughALensItIsTheLeastSquaresEllipse) {
  double worst = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Scene scene = random_scene(seed, true, seed % 2 ? 20 : 100, 60);
    const auto center = projected_circle_center(scene.camera, scene.circle);
    ASSERT_TRUE(center);
    const double error = (*center - brute_force(scene)).norm();
    worst = std::max(worst, error);
    EXPECT_LT(error, 1e-4);
  }
  RecordProperty("worst_px", std::to_string(worst));
}

TEST(CircleProjection, DerivativesAreThoseOfDifferences) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const bool distorted = seed % 3 != 0;
    const auto [camera, circle] = random_scene(seed, distorted, 30, 60);
    Eigen::Matrix<double, 2, 6> by_motion;
    Eigen::Matrix<double, 2, 10> by_parameters;
    ASSERT_TRUE(projected_circle_center(camera, circle, &by_motion, &by_parameters));
    const double tolerance = distorted ? 2e-4 : 1e-6;  // of the Jacobian's size
    for (int i = 0; i < 6; ++i) {
      Vector2d at[2];
      const double h = 1e-5;
      for (int side = 0; side < 2; ++side) {
        Eigen::Matrix<double, 6, 1> m = Eigen::Matrix<double, 6, 1>::Zero();
        m[i] = side ? h : -h;
        const Matrix3d turn =
            Eigen::AngleAxisd(m.head<3>().norm(),
                              m.head<3>().norm() > 0 ? m.head<3>().normalized().eval() : Vector3d::UnitX().eval())
                .toRotationMatrix();
        at[side] = *projected_circle_center(
            camera, {turn * circle.center + m.tail<3>(), turn * circle.u, turn * circle.v, circle.radius});
      }
      EXPECT_LT(((at[1] - at[0]) / (2 * h) - by_motion.col(i)).norm(), tolerance * by_motion.norm()) << "column " << i;
    }
    double Camera::*const fields[10] = {&Camera::f,  &Camera::s,  &Camera::skew, &Camera::u0, &Camera::v0,
                                        &Camera::k1, &Camera::k2, &Camera::k3,   &Camera::p1, &Camera::p2};
    for (int i = 0; i < 10; ++i) {
      const double h = i == 0 || (i > 1 && i < 5) ? 1e-2 : 1e-6;
      Vector2d at[2];
      for (int side = 0; side < 2; ++side) {
        Camera moved = camera;
        moved.*fields[i] += side ? h : -h;
        at[side] = *projected_circle_center(moved, circle);
      }
      EXPECT_LT(((at[1] - at[0]) / (2 * h) - by_parameters.col(i)).norm(),
                5 * tolerance * (by_parameters.col(i).norm() + 0.1))
          << "parameter " << i;
    }
  }
}

/// What an adjustment may try on its way: tilts through 90 degrees. Neither value nor derivatives jump.
TEST(CircleProjection, IsSmoothUpToTheEdgeAndBeyond) {
  for (const double radius_px : {6.0, 20.0, 60.0})
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE(testing::Message() << radius_px << " px, seed " << seed);
      const auto [camera, facing_circle] = random_scene(seed, true, radius_px, 0);
      std::mt19937_64 random(seed);
      const Vector3d facing = -facing_circle.center.normalized();
      const Vector3d side =
          Eigen::AngleAxisd(std::uniform_real_distribution<double>(0, 6.3)(random), facing) * facing.unitOrthogonal();
      constexpr double kStep = 0.05 * std::numbers::pi / 180;
      Vector2d before[2];
      for (int i = 0; i < 700; ++i) {  // 60 to 95 degrees
        const double tilt = std::numbers::pi / 3 + i * kStep;
        const auto tilted = [&](double angle) {
          const Vector3d normal = Eigen::AngleAxisd(angle, side) * facing;
          Circle3 k = facing_circle;
          k.u = normal.unitOrthogonal();
          k.v = normal.cross(k.u);
          return k;
        };
        const auto center = projected_circle_center(camera, tilted(tilt));
        ASSERT_TRUE(center) << tilt;
        // The two kinds of centre are up to 6e-4 radius² / px apart here, and go over within 92 steps.
        if (i >= 2) {
          ASSERT_LT((*center - 2 * before[1] + before[0]).norm(), 1e-6 * radius_px * radius_px) << tilt;
        }
        before[0] = before[1], before[1] = *center;
        if (i % 20) continue;
        Eigen::Matrix<double, 2, 6> by_motion;
        Eigen::Matrix<double, 2, 10> by_parameters;
        ASSERT_TRUE(projected_circle_center(camera, tilted(tilt), &by_motion, &by_parameters));
        for (int m = 0; m < 6; ++m) {
          Vector2d at[2];
          const double h = m < 3 ? 1e-5 : 1e-5 * facing_circle.center.z();
          for (int s = 0; s < 2; ++s) {
            Circle3 k = tilted(tilt);
            const Vector3d step = (s ? h : -h) * Vector3d::Unit(m % 3);
            if (m < 3) {
              const Matrix3d turn = Eigen::AngleAxisd(step.norm(), step.normalized()).toRotationMatrix();
              k.center = turn * k.center, k.u = turn * k.u, k.v = turn * k.v;
            } else {
              k.center += step;
            }
            at[s] = *projected_circle_center(camera, k);
          }
          ASSERT_LT(((at[1] - at[0]) / (2 * h) - by_motion.col(m)).norm(), 2e-3 * by_motion.norm())
              << tilt << ", " << m;
        }
      }
    }
}

TEST(CircleProjection, NothingBehindTheCameraOrBeyondTheLens) {
  Camera c{.width = 100, .height = 100, .f = 100, .u0 = 50, .v0 = 50};
  EXPECT_TRUE(projected_circle_center(c, {.center = {0, 0, 1}, .radius = 0.1}));
  EXPECT_FALSE(projected_circle_center(c, {.center = {0, 0, -1}, .radius = 0.1}));
  EXPECT_FALSE(projected_circle_center(c, {.center = {0, 0, 1}, .u = {0, 0, 1}, .v = {0, 1, 0}, .radius = 1.01}));
  EXPECT_FALSE(projected_circle_center(c, {.center = {0, 0, std::nan("")}, .radius = 0.1}));
  EXPECT_EQ(*projected_circle_center(c, {.center = {0.1, 0, 1}, .radius = 0}), Vector2d(60, 50));
  c.k1 = -0.2;  // farthest corrected radius .8607
  EXPECT_TRUE(projected_circle_center(c, {.center = {0.8, 0, 1}, .radius = 0.05}));
  EXPECT_FALSE(projected_circle_center(c, {.center = {0.8, 0, 1}, .radius = 0.07}));
  EXPECT_FALSE(projected_circle_center(c, {.center = {0.9, 0, 1}, .radius = 0.05}));
  EXPECT_TRUE(projected_circle_center(c, {.center = {0, 0, 1}, .u = {0, 0, 1}, .v = {0, 1, 0}, .radius = 0.1}))
      << "edge-on";
  EXPECT_EQ(*projected_circle_center(c, {.center = {0, 0, 1}, .radius = 0}), Vector2d(50, 50));
  Matrix3d h = Matrix3d::Identity();
  h(2, 0) = 1;
  EXPECT_TRUE(homography_circle_center(h, {0, 0}, 0.9).allFinite());
  EXPECT_FALSE(homography_circle_center(h, {0, 0}, 1.1).allFinite());
}

TEST(Homography, FindsTheOneThatMadeThePoints) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    Matrix3d h;
    h << uniform(500, 2000), uniform(-500, 500), uniform(0, 3000), uniform(-500, 500), uniform(500, 2000),
        uniform(0, 2000), uniform(-0.4, 0.4), uniform(-0.4, 0.4), 1;
    std::vector<Vector2d> a{{-0.9, -1}, {1, -0.8}, {0.9, 1.1}, {-1.1, 0.9}}, b;
    for (std::uint64_t i = 0; i < seed; ++i) a.push_back({uniform(-1, 1), uniform(-1, 1)});
    for (const Vector2d& p : a) b.push_back((h * p.homogeneous()).hnormalized());
    const Matrix3d found = find_homography(a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_LT(((found * a[i].homogeneous()).hnormalized() - b[i]).norm(), 1e-9);
      EXPECT_GT((found * a[i].homogeneous()).z(), 0);
    }
  }
}

TEST(Homography, MinimisesTheTransferError) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.5);
  Matrix3d h;
  h << 900, 100, 1500, -80, 1000, 900, 0.3, -0.2, 1;
  std::vector<Vector2d> a, b;
  for (int i = 0; i < 30; ++i) {
    a.push_back({(i % 6) / 3.0 - 1, (i / 6) / 2.5 - 1});
    b.push_back((h * a.back().homogeneous()).hnormalized() + Vector2d(noise(random), noise(random)));
  }
  const auto cost = [&](const Matrix3d& m) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += ((m * a[i].homogeneous()).hnormalized() - b[i]).squaredNorm();
    return sum;
  };
  const Matrix3d found = find_homography(a, b);
  const double least = cost(found);
  for (int i = 0; i < 9; ++i)
    for (const double step : {-1e-6, 1e-6}) {
      Matrix3d near = found;
      near(i / 3, i % 3) *= 1 + step;
      EXPECT_GE(cost(near), least * (1 - 1e-12));
    }
}

TEST(Homography, NamesWhatCannotBe) {
  const auto code = [](std::vector<Vector2d> a, std::vector<Vector2d> b) {
    return test::expect_error([&] { find_homography(a, b); }).code();
  };
  const std::vector<Vector2d> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_EQ(code({{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 0}, {1, 1}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code(square, {{0, 0}, {1, 0}, {1, 1}, {0, std::nan("")}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 1}, {2, 2}, {3, 3}}, square), ErrorCode::degenerate);
  EXPECT_EQ(code({{0, 0}, {1, 1}, {2, 2}, {3, 4}}, square), ErrorCode::degenerate);
  EXPECT_EQ(code(square, {{0, 0}, {1, 1}, {2, 2}, {3, 4}}), ErrorCode::degenerate);
  EXPECT_EQ(code({{5, 5}, {5, 5}, {5, 5}, {5, 5}}, square), ErrorCode::degenerate);
  EXPECT_EQ(code({{0, 0}, {0, 0}, {1, 1}, {3, 4}}, square), ErrorCode::degenerate);
  EXPECT_EQ(code(square, {{0, 0}, {1, 1}, {1, 0}, {0, 1}}), ErrorCode::degenerate) << "a bow tie: no view of a square";
}

}  // namespace
}  // namespace lumihull::calib
