// What is left between a circle's measured centre and the predicted one: discs photographed by the rig, without noise,
// and measured by fit_ellipse.
#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/ellipse.h>
#include <lumihull/rig/flat_print.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "support.h"

namespace lumihull::calib {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct Bias {
  Vector2d corrected{0, 0};    ///< measured - predicted ellipse's centre, px
  Vector2d uncorrected{0, 0};  ///< measured - picture of the circle's centre
  EllipseState state = EllipseState::no_fit;
};

/// One disc of `major_px` across, tilted about a direction in the picture, off the axis in a picture of its own size.
Bias measure(double major_px, double tilt, double turn, bool distorted, double phase) {
  Camera whole{.width = 4000, .height = 3000, .f = 2400, .u0 = 2000, .v0 = 1500};
  if (distorted) whole.k1 = 0.12, whole.k2 = -0.03, whole.p1 = 0.001, whole.p2 = -0.0008;
  const Vector3d ray = whole.ray({900 + phase, 500 + 0.7 * phase}).value();
  Circle3 circle;
  circle.center = ray;
  circle.radius = 0.5 * major_px / whole.f * ray.norm();
  const Vector3d facing = ray.normalized();  // into the paper
  const Vector3d side = Eigen::AngleAxisd(turn, facing) * facing.unitOrthogonal();
  const Vector3d normal = Eigen::AngleAxisd(tilt, side) * facing;
  circle.u = normal.unitOrthogonal(), circle.v = normal.cross(circle.u);

  // Its ellipse, about, and a picture about that.
  Vector2d mean = Vector2d::Zero();
  Matrix2d axes = Matrix2d::Zero();
  constexpr int kPlaces = 64;
  for (int i = 0; i < kPlaces; ++i) {
    const double t = 2 * std::numbers::pi * i / kPlaces;
    const Vector2d p =
        whole.project(circle.center + circle.radius * (std::cos(t) * circle.u + std::sin(t) * circle.v)).value();
    mean += p / kPlaces;
    axes.col(0) += 2.0 / kPlaces * std::cos(t) * p, axes.col(1) += 2.0 / kPlaces * std::sin(t) * p;
  }
  const int half = int(0.7 * major_px) + 10;
  const Vector2d corner = (mean.array().floor() - half).matrix();
  View view;
  view.camera = whole;
  view.camera.width = view.camera.height = 2 * half;
  view.camera.u0 -= corner.x(), view.camera.v0 -= corner.y();

  rig::FlatPrint print;
  print.low = Vector2d::Constant(-4 * circle.radius), print.high = -print.low;
  print.paper = Eigen::Vector3f::Constant(0.8F);
  rig::FlatShape disc;
  disc.color = Eigen::Vector3f::Constant(0.1F), disc.radius = circle.radius;
  print.shapes.push_back(disc);
  Matrix3d r;
  r << circle.u, circle.v, normal;
  print.world_from_print = Pose::from_matrix(r, circle.center);
  const Image photo = rig::photograph_prints(view, std::span(&print, 1), Eigen::Vector3f::Constant(0.8F),
                                             {.edge_samples = 64, .blur_px = 0.8}, 1, true);
  LightPlane plane;
  plane.values = Image(photo.width(), photo.height(), 1, PixelType::f32);
  for (int y = 0; y < photo.height(); ++y)
    for (int x = 0; x < photo.width(); ++x) plane.values.row<float>(y)[x] = photo.row<float>(y)[3 * x];
  plane.noise.read = 1e-6;

  const Vector2d center = mean - corner;
  Matrix3d dual = Matrix3d::Zero();
  dual.topLeftCorner<2, 2>() = center * center.transpose() - axes * axes.transpose();
  dual.topRightCorner<2, 1>() = center, dual.bottomLeftCorner<1, 2>() = center.transpose(), dual(2, 2) = 1;
  const EllipseFit fit = fit_ellipse(plane, Ellipse::from_dual_conic(dual).value());
  return {fit.ellipse.center - projected_circle_center(view.camera, circle).value(),
          fit.ellipse.center - view.camera.project(circle.center).value(), fit.state};
}

TEST(CircleBias, IsGoneAfterThePrediction) {
  double worst = 0;
  for (const bool distorted : {false, true})
    for (const double major : {8.0, 15.0, 30.0, 60.0, 100.0})
      for (const double tilt_degrees : {0.0, 40.0, 60.0, 70.0}) {
        if (major * std::cos(tilt_degrees * std::numbers::pi / 180) < 5) continue;
        double before = 0, after = 0;
        for (int k = 0; k < 4; ++k) {
          const Bias b = measure(major, tilt_degrees * std::numbers::pi / 180, 0.3 + 0.8 * k, distorted, 0.37 * k);
          EXPECT_EQ(b.state, EllipseState::good) << major << " " << tilt_degrees;
          before = std::max(before, b.uncorrected.norm()), after = std::max(after, b.corrected.norm());
        }
        worst = std::max(worst, after);
        if (tilt_degrees > 0 && major >= 15) {
          EXPECT_GT(before, 0.01) << "there is something to correct";
        }
        EXPECT_LT(after, 0.003) << (distorted ? "lens " : "pinhole ") << major << " px, " << tilt_degrees << " degrees";
      }
  RecordProperty("worst_px", std::to_string(worst));
}

}  // namespace
}  // namespace lumihull::calib
