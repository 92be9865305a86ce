#include <lumihull/base/camera.h>

#include <cmath>
#include <limits>
#include <random>

#include "support.h"

namespace lumihull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Cameras as different as users have them: from no distortion to a 10 mm lens, skewed, off-centre.
Camera random_camera(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Camera c{.width = 3072, .height = 2048};
  c.f = uniform(1200, 5000);
  c.s = uniform(0.7, 1.4);
  c.skew = uniform(-80, 80);
  c.u0 = uniform(-1000, 4000);
  c.v0 = uniform(-1000, 3000);
  if (seed % 4) {
    c.k1 = uniform(-0.1, 0.1);
    c.k2 = uniform(-0.03, 0.03);
    c.k3 = uniform(-0.005, 0.005);
    c.p1 = uniform(-0.003, 0.003);
    c.p2 = uniform(-0.003, 0.003);
  }
  return c;
}

TEST(Camera, DistortInvertsCorrect) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const Camera c = random_camera(seed);
    const double limit = std::min(0.98 * c.domain_radius(), 1.2);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 50; ++i) {
      const double r = limit * std::sqrt(std::uniform_real_distribution<double>(0, 1)(random));
      const double a = std::uniform_real_distribution<double>(0, 6.283)(random);
      const Vector2d d(r * std::cos(a), r * std::sin(a));
      const auto back = c.distort(c.correct(d));
      ASSERT_TRUE(back);
      EXPECT_LT((c.correct(*back) - c.correct(d)).norm(), 1e-12);
      EXPECT_LT((*back - d).norm(), 1e-10);
    }
  }
}

TEST(Camera, RefusesPointsBeyondTheFold) {
  // x + k1 x^3 turns round at x = 1 / sqrt(-3 k1): closed form.
  const Camera c{.width = 100, .height = 100, .f = 100, .u0 = 50, .v0 = 50, .k1 = -0.2};
  const double fold = 1 / std::sqrt(0.6);
  EXPECT_NEAR(c.domain_radius(), fold, 1e-9);
  const double farthest = fold * (1 - 0.2 * fold * fold);
  const auto inside = c.distort({0.999 * farthest, 0});
  ASSERT_TRUE(inside);
  EXPECT_LT(inside->x(), fold);
  EXPECT_FALSE(c.distort({1.001 * farthest, 0}));
  EXPECT_FALSE(c.project({2 * farthest, 0, 1})) << "x = -2.5 also solves the equation, on the folded branch";
  EXPECT_FALSE(c.ray({50 + 100 * 1.01 * fold, 50}));
  EXPECT_TRUE(c.ray({50 + 100 * 0.99 * fold, 50}));
  EXPECT_EQ((Camera{.width = 1, .height = 1, .f = 1, .k1 = 0.2}).domain_radius(),
            std::numeric_limits<double>::infinity());
}

TEST(Camera, NothingBehindAndNothingNotFinite) {
  Camera c{.width = 100, .height = 100, .f = 100, .u0 = 50, .v0 = 50, .k1 = 0.1};
  EXPECT_FALSE(c.project({0, 0, 0}));
  EXPECT_FALSE(c.project({0, 0, -1}));
  EXPECT_FALSE(c.project({0, 0, std::nan("")}));
  EXPECT_FALSE(c.project({std::nan(""), 0, 1}));
  c.f = 0;
  EXPECT_THAT(test::expect_error([&] { c.validate(); }).message(), testing::HasSubstr("focal length"));
  c.f = 100;
  c.k2 = std::nan("");
  EXPECT_THAT(test::expect_error([&] { c.validate(); }).message(), testing::HasSubstr("distortion"));
}

TEST(Camera, ProjectionFollowsTheMatrixWhereThereIsNoDistortion) {
  const Camera c = random_camera(4);
  ASSERT_FALSE(c.has_distortion());
  const Vector3d x(0.3, -0.2, 1.7);
  const Vector3d p = c.matrix() * x;
  EXPECT_LT((*c.project(x) - p.hnormalized()).norm(), 1e-10);
}

TEST(Camera, RayAndProjectionAreInverse) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    const Camera c = random_camera(seed);
    for (const Vector2d& px :
         {Vector2d(0.5, 0.5), Vector2d(3000, 100), Vector2d(1500, 1024), Vector2d(3071.5, 2047.5)}) {
      const auto ray = c.ray(px);
      if (!ray) continue;  // outside the lens model's domain
      const auto back = c.project(2.5 * *ray);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - px).norm(), 1e-8);
    }
  }
}

TEST(Camera, JacobiansAgreeWithFiniteDifferences) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    const Camera c = random_camera(seed);
    const Vector3d x = Vector3d(0.4, -0.3, 1) * 1.5;
    Vector2d pixel;
    Matrix23d by_point;
    Eigen::Matrix<double, 2, 10> by_parameters;
    ASSERT_TRUE(c.project_with_parameter_jacobian(x, &pixel, &by_point, &by_parameters));
    EXPECT_EQ(pixel, *c.project(x));
    // Fourth-order central differences: error about h^4, rounding about 1e-16 |u| / h.
    const auto derivative = [](const auto& f, double h) -> Vector2d {
      return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
    };
    for (int k = 0; k < 3; ++k) {
      const Vector2d d = derivative([&](double h) { return *c.project(x + h * Vector3d::Unit(k)); }, 1e-3);
      EXPECT_LT((d - by_point.col(k)).norm(), 1e-8 * (1 + by_point.col(k).norm()));
    }
    double Camera::*const fields[] = {&Camera::f,  &Camera::s,  &Camera::skew, &Camera::u0, &Camera::v0,
                                      &Camera::k1, &Camera::k2, &Camera::k3,   &Camera::p1, &Camera::p2};
    for (int k = 0; k < 10; ++k) {
      const double h = k == 0 || (k >= 2 && k < 5) ? 1e-1 : 1e-4;
      const Vector2d d = derivative(
          [&](double e) {
            Camera moved = c;
            moved.*fields[k] += e;
            return *moved.project(x);
          },
          h);
      EXPECT_LT((d - by_parameters.col(k)).norm(), 1e-8 * (1 + by_parameters.col(k).norm())) << "parameter " << k;
    }
  }
}

TEST(Pose, ComposesAndInverts) {
  const Pose a{Eigen::Quaterniond(0.1, 0.7, -0.3, 0.4).normalized(), {1, 2, 3}};
  const Pose b{Eigen::Quaterniond(-0.5, 0.2, 0.3, 0.9).normalized(), {-1, 0.5, 2}};
  const Vector3d x(0.3, -4, 2);
  EXPECT_LT(((a * b) * x - a * (b * x)).norm(), 1e-14);
  EXPECT_LT((a.inverse() * (a * x) - x).norm(), 1e-14);
  EXPECT_LT((a * a.center()).norm(), 1e-14);
}

TEST(Pose, LookAtPutsTheTargetAheadAndUpAbove) {
  const Pose pose = look_at({3, 0, 1}, {0, 0, 1}, {0, 0, 1});
  const Vector3d target = pose * Vector3d(0, 0, 1), above = pose * Vector3d(0, 0, 2);
  EXPECT_LT((target - Vector3d(0, 0, 3)).norm(), 1e-14);
  EXPECT_LT(above.y(), 0) << "y points down in the camera";
  EXPECT_NEAR(pose.rotation.toRotationMatrix().determinant(), 1, 1e-14);
  EXPECT_TRUE(look_at({0, 0, 5}, {0, 0, 0}, {0, 0, 1}).rotation.coeffs().allFinite()) << "straight down";
}

}  // namespace
}  // namespace lumihull
