// Lens models of other programs and their refits, against OpenCV's projections.

#include "lens_models.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "support.h"

namespace lumihull {
namespace {

using internal::ForwardCamera;
using test::expect_error;

ForwardCamera wide_angle() {
  ForwardCamera c;
  c.width = 1200;
  c.height = 800;
  c.fx = 905;
  c.fy = 900;
  c.cx = 590;
  c.cy = 410;
  c.lens = ForwardCamera::Lens::opencv;
  c.k[0] = -0.21;
  c.k[1] = 0.06;
  c.k[2] = -0.004;
  c.p1 = 0.0008;
  c.p2 = -0.0005;
  return c;
}

TEST(LensModels, ProjectAsOpenCvDoes) {
  ForwardCamera c = wide_angle();
  c.k[3] = 0.02;
  c.k[4] = -0.01;
  c.k[5] = 0.003;
  const cv::Matx33d k(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  const std::vector<double> lens{c.k[0], c.k[1], c.p1, c.p2, c.k[2], c.k[3], c.k[4], c.k[5]};
  ForwardCamera fish = c;
  fish.lens = ForwardCamera::Lens::fisheye;
  for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0, 0), {0.3, -0.2}, {-0.6, 0.4}, {0.01, 0.5}}) {
    const std::vector<cv::Point3d> points{{ray.x(), ray.y(), 1}};
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), k, lens, pixels);
    EXPECT_NEAR((c.project(ray) - Eigen::Vector2d(pixels[0].x, pixels[0].y)).norm(), 0, 1e-9);
    cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), k, std::vector<double>(fish.k, fish.k + 4));
    EXPECT_NEAR((fish.project(ray) - Eigen::Vector2d(pixels[0].x, pixels[0].y)).norm(), 0, 1e-9);
  }
}

TEST(LensModels, RayInvertsProject) {
  for (const auto lens : {ForwardCamera::Lens::none, ForwardCamera::Lens::opencv, ForwardCamera::Lens::fisheye}) {
    ForwardCamera c = wide_angle();
    c.lens = lens;
    for (int y = 0; y <= 800; y += 100)
      for (int x = 0; x <= 1200; x += 100) {
        const auto ray = c.ray(Eigen::Vector2d(x, y));
        ASSERT_TRUE(ray) << x << " " << y;
        EXPECT_NEAR((c.project(*ray) - Eigen::Vector2d(x, y)).norm(), 0, 1e-6);
      }
  }
}

TEST(LensModels, RefitReportsTheErrorThatItMakes) {
  const ForwardCamera c = wide_angle();
  const auto refit = internal::refit_camera(c, 0.5, "camera 1");
  EXPECT_LT(refit.largest_error_px, 0.3);
  RecordProperty("largest_error_px", std::to_string(refit.largest_error_px));
  // Judged on other points than the refit itself judges.
  double worst = 0;
  for (int y = 7; y < 800; y += 13)
    for (int x = 5; x < 1200; x += 17) {
      const auto ray = c.ray(Eigen::Vector2d(x, y));
      ASSERT_TRUE(ray);
      const auto pixel = refit.camera.project(ray->homogeneous());
      ASSERT_TRUE(pixel);
      worst = std::max(worst, (*pixel - Eigen::Vector2d(x, y)).norm());
    }
  EXPECT_LT(worst, refit.largest_error_px * 1.2 + 1e-9);
  EXPECT_GT(worst, refit.largest_error_px * 0.5);
}

TEST(LensModels, RefitRecoversAPolynomialThatIsExact) {
  // Ours refitted to theirs and back gives the camera that it was, where both directions fit.
  Camera camera;
  camera.width = 1000;
  camera.height = 700;
  camera.f = 950;
  camera.s = 1.01;
  camera.u0 = 510;
  camera.v0 = 345;
  camera.k1 = 0.06;
  camera.k2 = -0.01;
  camera.p1 = 0.0004;
  const auto theirs = internal::refit_forward(camera, 6, "camera");
  EXPECT_LT(theirs.largest_error_px, 0.01);  // better than the picture needs, though no polynomial of theirs is exact
  const auto back = internal::refit_camera(theirs.camera, 0.5, "camera");
  EXPECT_LT(back.largest_error_px, 0.01);
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(20, 30), {500, 350}, {990, 20}, {100, 690}}) {
    const auto ray = camera.ray(pixel);
    ASSERT_TRUE(ray);
    EXPECT_NEAR((*back.camera.project(*ray) - pixel).norm(), 0, 0.02);
  }
}

TEST(LensModels, NoDistortionIsExact) {
  ForwardCamera c = wide_angle();
  c.lens = ForwardCamera::Lens::none;
  const auto refit = internal::refit_camera(c, 0.5, "c");
  EXPECT_EQ(refit.largest_error_px, 0);
  EXPECT_EQ(refit.camera.f, c.fy);
  EXPECT_EQ(refit.camera.s * refit.camera.f, c.fx);
  EXPECT_EQ(internal::refit_forward(refit.camera, 2, "c").largest_error_px, 0);
}

TEST(LensModels, AFisheyeOfModerateAngleRefitsAndAWideOneIsRefused) {
  ForwardCamera c;
  c.width = 1000;
  c.height = 800;
  c.fx = c.fy = 1400;
  c.cx = 500;
  c.cy = 400;
  c.lens = ForwardCamera::Lens::fisheye;
  c.k[0] = -0.01;
  EXPECT_LT(internal::refit_camera(c, 0.5, "fish").largest_error_px, 0.05);
  c.fx = c.fy = 330;  // 110 degrees to the corner
  const Error error = expect_error([&] { internal::refit_camera(c, 0.5, "fish"); });
  EXPECT_EQ(error.code(), ErrorCode::unsupported);
  EXPECT_EQ(error.subject(), "fish");
}

TEST(LensModels, ALensThatFoldsInsideThePictureIsRefused) {
  ForwardCamera c = wide_angle();
  c.k[0] = -1.2;
  c.k[1] = c.k[2] = 0;
  const Error error = expect_error([&] { internal::refit_camera(c, 0.5, "folded"); });
  EXPECT_EQ(error.code(), ErrorCode::unsupported);
  EXPECT_THAT(error.message(), testing::HasSubstr("no unique ray"));
}

}  // namespace
}  // namespace lumihull
