// Ellipse algebra, and the dual-conic operator on pictures of known truth.
#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <numbers>

#include "ellipse_picture.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using test::EllipseScene;

TEST(Ellipse, DualConicHoldsItsTangents) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> part(0, 1);
  for (int i = 0; i < 100; ++i) {
    const double b = 1 + 50 * part(random);
    const Ellipse e{
        {1000 * part(random), 700 * part(random)}, b * (1 + 3 * part(random)), b, 3.1 * (part(random) - .5)};
    const Eigen::Matrix3d dual = e.dual_conic();
    for (double t = 0; t < 6; t += 0.7) {
      const Eigen::Vector2d p = e.point(t), ahead = e.point(t + 1e-5) - e.point(t - 1e-5);
      const Eigen::Vector2d n = Eigen::Vector2d(ahead.y(), -ahead.x()).normalized();
      const Eigen::Vector3d line(n.x(), n.y(), -n.dot(p));
      EXPECT_NEAR(line.dot(dual * line) / (e.a * e.a), 0, 1e-7);
    }
    const std::optional<Ellipse> back = Ellipse::from_dual_conic(-3 * dual);
    ASSERT_TRUE(back);
    EXPECT_NEAR((back->center - e.center).norm(), 0, 1e-9);
    EXPECT_NEAR(back->a, e.a, 1e-6);
    EXPECT_NEAR(back->b, e.b, 1e-6);
    EXPECT_NEAR(std::remainder(back->angle - e.angle, std::numbers::pi), 0, 1e-6);
  }
}

TEST(Ellipse, RefusesWhatIsNone) {
  Eigen::Matrix3d dual = Eigen::Matrix3d::Identity();  // imaginary
  EXPECT_FALSE(Ellipse::from_dual_conic(dual));
  dual(0, 0) = -1;  // a hyperbola
  EXPECT_FALSE(Ellipse::from_dual_conic(dual));
  dual(2, 2) = 0;
  EXPECT_FALSE(Ellipse::from_dual_conic(dual));
  EXPECT_FALSE(Ellipse::from_dual_conic(Eigen::Matrix3d::Constant(std::nan(""))));
  EXPECT_EQ(Ellipse::from_shape({0, 0}, Eigen::Matrix2d::Identity())->angle, 0);
}

TEST(DualConicFit, CenterWithoutNoise) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 8; ++i) {
    const EllipseScene scene = test::scene_of(12, i % 2 ? 0.6 : 1, 0.3 * i, 1, random);
    std::mt19937_64 none(1);
    const LightPlane plane = noisy_plane(scene, render(scene), {1e-12, 0}, none);
    const EllipseFit fit = dual_conic_fit(plane, test::rough_guess(scene.ellipses[0].ellipse, random));
    ASSERT_EQ(fit.state, EllipseState::good);
    EXPECT_LT((fit.ellipse.center - scene.ellipses[0].ellipse.center).norm(), 0.01);
    EXPECT_NEAR(fit.blur_px, 1, 0.4);
  }
}

TEST(DualConicFit, CovarianceIsThatOfItsErrors) {
  std::mt19937_64 random(2);
  for (const PlaneNoise noise : {PlaneNoise{64e-6, 0}, PlaneNoise{1e-5, 4e-4}}) {
    double square = 0, mahalanobis = 0;
    int count = 0;
    for (int phase = 0; phase < 10; ++phase) {
      const EllipseScene scene = test::scene_of(12, phase % 2 ? 0.6 : 1, phase, 1, random);
      const std::vector<double> values = render(scene);
      const Ellipse& truth = scene.ellipses[0].ellipse;
      for (int i = 0; i < 60; ++i) {
        const EllipseFit fit = dual_conic_fit(noisy_plane(scene, values, noise, random), truth);
        ASSERT_EQ(fit.state, EllipseState::good);
        const Eigen::Vector2d error = fit.ellipse.center - truth.center;
        square += error.squaredNorm();
        mahalanobis += error.dot(fit.center_covariance().inverse() * error);
        ++count;
      }
    }
    std::printf("rms %.4f px, mahalanobis² %.2f\n", std::sqrt(square / count), mahalanobis / count);
    EXPECT_LT(std::sqrt(square / count), 0.02);
    EXPECT_GT(mahalanobis / count, 1.8);
    EXPECT_LT(mahalanobis / count, 2.3);
  }
}

}  // namespace
}  // namespace lumihull::calib
