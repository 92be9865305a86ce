#include <lumihull/rig/flat_print.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "support.h"

namespace lumihull::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kBlack(0, 0, 0), kWhite(1, 1, 1);

FlatShape disc(const Vector2d& center, double radius, const Vector3f& color) {
  FlatShape s;
  s.center = center, s.radius = radius, s.color = color;
  return s;
}

/// A white sheet with one black disc, 1 m before the camera, turned by `tilt` about an axis in its plane.
FlatPrint sheet(double radius, double tilt = 0, double axis = 0) {
  FlatPrint print;
  print.low = {-1, -1}, print.high = {1, 1};
  print.paper = kWhite;
  print.shapes = {disc({0, 0}, radius, kBlack)};
  print.world_from_print.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vector3d(std::cos(axis), std::sin(axis), 0)));
  print.world_from_print.translation = {.0123, -.0077, 1};
  return print;
}

View view(int size = 100, double f = 800) {
  View v;
  v.camera.width = v.camera.height = size;
  v.camera.f = f, v.camera.u0 = v.camera.v0 = .5 * size;
  return v;
}

Image photograph(const View& v, const std::vector<FlatPrint>& prints, const PrintPhotoOptions& options = {}) {
  return photograph_prints(v, prints, {.25f, .25f, .25f}, options, 1, true);
}

/// Sums over pixels are integrals where the light holds no detail below a pixel: with a little blur.
PrintPhotoOptions smooth(double sigma = 1) {
  PrintPhotoOptions options;
  options.blur_px = sigma;
  return options;
}

struct Moments {
  double area = 0;
  Vector2d center{0, 0};
};

/// Area and centroid of what is darker than white, green channel.
Moments moments(const Image& image) {
  Moments m;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const double w = 1 - image.row<float>(y)[3 * x + 1];
      m.area += w, m.center += w * Vector2d(x + .5, y + .5);
    }
  m.center /= m.area;
  return m;
}

/// Area and centre of the ellipse in which a disc is seen: C* = P B Pᵀ (Hartley & Zisserman 2000, 8.3).
Moments ellipse(const View& v, const FlatPrint& print) {
  const Pose pose = v.cam_from_world * print.world_from_print;
  const Matrix3d r = pose.rotation.toRotationMatrix();
  const FlatShape& s = print.shapes.at(0);
  Matrix3d h;
  h << r.col(0), r.col(1), pose * Vector3d(s.center.x(), s.center.y(), 0);
  h = v.camera.matrix() * h;
  const Matrix3d dual = h * Vector3d(-s.radius * s.radius, -s.radius * s.radius, 1).asDiagonal() * h.transpose();
  const Matrix3d c = dual / dual(2, 2);
  Moments m;
  m.center = {c(0, 2), c(1, 2)};
  const Eigen::Matrix2d shape = m.center * m.center.transpose() - c.topLeftCorner<2, 2>();
  m.area = M_PI * std::sqrt(shape.determinant());
  return m;
}

TEST(FlatPrint, FrontalDiscHasItsAreaAndCentre) {
  for (const double radius_px : {2.6, 6., 13.37, 30.}) {
    SCOPED_TRACE(radius_px);
    const FlatPrint print = sheet(radius_px / 800);
    const Moments seen = moments(photograph(view(), {print}, smooth()));
    EXPECT_NEAR(seen.area / (M_PI * radius_px * radius_px), 1, 1e-4);
    EXPECT_LT((seen.center - Vector2d(50 + .0123 * 800, 50 - .0077 * 800)).norm(), 1e-4);
  }
}

TEST(FlatPrint, TiltedDiscIsTheEllipseOfTheDualConic) {
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const FlatPrint print = sheet((3 + i % 7 * 4) / 800., .03 * i, 1.7 * i);
    const Moments seen = moments(photograph(view(), {print}, smooth())), truth = ellipse(view(), print);
    EXPECT_NEAR(seen.area / truth.area, 1, 1e-3);
    EXPECT_LT((seen.center - truth.center).norm(), 1e-3);
  }
}

TEST(FlatPrint, LensBendsWhatIsSeen) {
  // Against sampling pixel by pixel: 24 x 24 rays each.
  View v = view(60, 60);
  v.camera.k1 = -.2, v.camera.k2 = .05, v.camera.p1 = .01, v.camera.p2 = -.005;
  const FlatPrint print = sheet(.25, .8, .6);
  const Image seen = photograph(v, {print});
  const Pose print_from_cam = print.world_from_print.inverse() * v.cam_from_world.inverse();
  const int n = 24;
  double worst = 0, sum = 0;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 60; ++x) {
      double truth = 0;
      for (int i = 0; i < n * n; ++i) {
        const Vector3d d = print_from_cam.rotation * *v.camera.ray({x + (i % n + .5) / n, y + (i / n + .5) / n});
        const Vector3d o = print_from_cam.translation;
        const double depth = -o.z() / d.z();
        const Vector2d p = (o + depth * d).head<2>();
        const bool on_sheet = depth > 0 && p.cwiseAbs().maxCoeff() <= 1;
        truth += (!on_sheet ? .25 : p.norm() < .25 ? 0. : 1.) / (n * n);
      }
      const double error = seen.row<float>(y)[3 * x] - truth;
      worst = std::max(worst, std::abs(error)), sum += error;
    }
  EXPECT_LT(worst, .03);  // the sampling's own error
  EXPECT_LT(std::abs(sum / 3600), 1e-5);
}

TEST(FlatPrint, EdgesAlongRowsAndColumnsAreExact) {
  FlatPrint print = sheet(.01);
  FlatShape square;
  square.color = kBlack;
  square.polygon = {{-.01, -.01}, {.01, -.01}, {.01, .01}, {-.01, .01}};
  print.shapes = {square};
  for (const double angle : {0., .3}) {
    print.world_from_print.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
    const Moments seen = moments(photograph(view(), {print}, smooth()));
    EXPECT_NEAR(seen.area, 16 * 16, .01);
    EXPECT_LT((seen.center - Vector2d(50 + .0123 * 800, 50 - .0077 * 800)).norm(), 5e-4);
  }
}

TEST(FlatPrint, NearerSheetsHideOthers) {
  FlatPrint far = sheet(.02), near;
  near.low = {-.02, -.02}, near.high = {.02, .02};
  near.paper = kWhite;
  near.world_from_print.translation = {.0123 * .5, -.0077 * .5, .5};  // before the disc
  for (const auto& order : {std::vector{far, near}, std::vector{near, far}})
    EXPECT_NEAR(moments(photograph(view(), order)).area, 0, 1e-6);
  near.world_from_print.translation = {.0123 * 2, -.0077 * 2, 2};  // behind
  EXPECT_GT(moments(photograph(view(), {near, far})).area, 700);
  // Half a sheet over half of the disc, its edge anywhere in a pixel.
  near.world_from_print.translation = {.0123 * .5 + .02, -.0077 * .5, .5};
  EXPECT_NEAR(moments(photograph(view(), {far, near})).area, M_PI * 16 * 16 / 2, .05);
}

TEST(FlatPrint, WhatCannotBeSeenIsNotDrawn) {
  const View v = view();
  const auto is_background = [&](const FlatPrint& print) {
    const Image image = photograph(v, {print});
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 300; ++x)
        if (image.row<float>(y)[x] != .25f) return false;
    return true;
  };
  FlatPrint print = sheet(.01);
  print.world_from_print.translation.z() = -1;  // behind the camera
  EXPECT_TRUE(is_background(print));
  print.world_from_print.translation = {0, 0, 0};  // the camera lies in it
  EXPECT_TRUE(is_background(print));
  print = sheet(.01, M_PI / 2);  // edge-on
  print.world_from_print.translation = {0, 0, 1};
  EXPECT_TRUE(is_background(print));
  EXPECT_EQ(photograph(v, {}).row<float>(3)[7], .25f);
  print = sheet(.01, M_PI);  // its back: bare paper
  const Image back = photograph(v, {print});
  EXPECT_EQ(moments(back).area, 0);
}

TEST(FlatPrint, BlurKeepsTheLightAndHasItsVariance) {
  for (const double sigma : {.7, .9, 1., 2.}) {
    SCOPED_TRACE(sigma);
    const double r = 5;
    const Image seen = photograph(view(), {sheet(r / 800)}, smooth(sigma));
    const Moments m = moments(seen);
    EXPECT_NEAR(m.area / (M_PI * r * r), 1, 1e-4);
    double variance = 0;
    for (int y = 24; y < 64; ++y)  // farther off there is only rounding
      for (int x = 40; x < 80; ++x) {
        const double dx = x + .5 - m.center.x();
        variance += (1 - seen.row<float>(y)[3 * x]) * dx * dx / m.area;
      }
    // The disc's, the Gaussian's, and the pixel's.
    EXPECT_NEAR(variance, r * r / 4 + sigma * sigma + 1. / 12, 2e-3);
  }
}

TEST(FlatPrint, NoiseHasItsVarianceAndItsSeed) {
  PrintPhotoOptions options;
  options.noise_read = .01, options.noise_shot = .001;
  const View v = view(200);
  const auto take = [&](std::uint64_t seed) { return photograph_prints(v, {}, {.5f, .5f, .5f}, options, seed, true); };
  const Image a = take(1), b = take(1), c = take(2);
  double mean = 0, square = 0, product = 0;
  const int n = 200 * 600;
  for (int i = 0; i < n; ++i) {
    const double x = a.row<float>(0)[i] - .5, y = c.row<float>(0)[i] - .5;
    ASSERT_EQ(a.row<float>(0)[i], b.row<float>(0)[i]);
    mean += x / n, square += x * x / n, product += x * y / n;
  }
  const double variance = .01 * .01 + .001 * .5;
  EXPECT_NEAR(mean, 0, 3e-4);
  EXPECT_NEAR(square / variance, 1, .02);
  EXPECT_NEAR(product / variance, 0, .02);
}

TEST(FlatPrint, FileIsAsTheCameraWritesIt) {
  PrintPhotoOptions options;
  options.exposure = .5, options.shading = {.4f, 0};
  const Image light = photograph(view(), {sheet(.02)}, options);
  EXPECT_NEAR(light.row<float>(1)[0], .5 * (1 - .4 * .495), 1e-6);
  EXPECT_NEAR(light.row<float>(1)[297], .5 * (1 + .4 * .495), 1e-6);
  for (const bool bayer : {false, true})
    for (const int quality : {0, 90}) {
      options.bayer = bayer, options.jpeg_quality = quality;
      const Image photo = photograph_prints(view(), std::vector{sheet(.02)}, kBlack, options, 1);
      ASSERT_EQ(photo.type(), PixelType::u8);
      ASSERT_EQ(photo.channels(), 3);
      EXPECT_NEAR(photo.row<std::uint8_t>(1)[0], 255 * srgb_from_linear(light.row<float>(1)[0]), quality ? 4 : 1);
      EXPECT_NEAR(photo.row<std::uint8_t>(43)[3 * 60 + 1], 0, quality ? 4 : 1);
    }
}

TEST(FlatPrint, PointGridsArePrintedWhereTheirPointsAre) {
  calib::PointGrid grid;
  grid.columns = 4, grid.rows = 3, grid.spacing_m = .02;
  FlatPrint board = print_of(grid, kBlack, kWhite);
  EXPECT_EQ(board.shapes.size(), 10u);  // of 5 x 4 fields
  grid.kind = calib::PointGrid::Kind::circles;
  const FlatPrint dots = print_of(grid, kBlack, kWhite);
  ASSERT_EQ(dots.shapes.size(), 12u);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(dots.shapes[std::size_t(i)].center, grid.point(i));
  // Round an inner corner ink and paper share the light.
  board.world_from_print.translation = {0, 0, 1};
  const Image photo = photograph(view(), {board});
  double sum = 0;
  for (int y = 46; y < 54; ++y)
    for (int x = 46; x < 54; ++x) sum += photo.row<float>(y)[3 * x];
  EXPECT_NEAR(sum, 32, 1e-3);
  EXPECT_EQ(photo.row<float>(48)[3 * 48], 0);  // the field at the top left is ink
  EXPECT_EQ(photo.row<float>(48)[3 * 52], 1);
}

TEST(FlatPrint, TargetsShowTheirCells) {
  const auto linear = [](const calib::Rgb& c) { return linear_from_srgb(float(c[1]) / 255); };
  for (const char* family : {"paper4x4", "matrix5x5", "matrix6x6", "apriltag:36h11", "aruco:6x6_250"})
    for (const double stretch : {1., 1.02}) {
      SCOPED_TRACE(family);
      calib::TargetDesign design;
      design.family = calib::TargetFamily::by_name(family);
      design.scale_y = stretch;
      const int id = design.family.ids()[7], n = design.family.grid();
      const bool circles = design.family.kind() == calib::TargetKind::circles;
      const double cell = circles ? design.size_m : design.size_m / n;
      FlatPrint print = print_of(design, id);
      print.world_from_print.translation = {0, 0, 1};
      const View v = view(20 * (n + 4), 20 / cell);  // 20 px a cell
      const Image photo = photograph(v, {print});
      const auto cells = design.family.cells(id);
      for (int i = 0; i < n * n; ++i) {
        const Vector2d place = Vector2d(i % n - .5 * (n - 1), (i / n - .5 * (n - 1)) * stretch) * cell;
        const Vector2d px = *v.camera.project({place.x(), place.y(), 1});
        const float seen = photo.row<float>(int(px.y()))[3 * int(px.x()) + 1];
        const bool light = cells[std::size_t(i)] == calib::Cell::light;
        EXPECT_NEAR(seen, linear(light ? design.paper : design.ink), 1e-4) << i;
        if (!circles) continue;
        EXPECT_LT((place - design.feature(i)).norm(), 1e-12);
        // Between a ring's edges and outside of it.
        EXPECT_NEAR(photo.row<float>(int(px.y()))[3 * int(px.x() + 3) + 1], linear(design.ink), 1e-4);
        EXPECT_NEAR(photo.row<float>(int(px.y()))[3 * int(px.x() + 7) + 1], linear(design.paper), 1e-4);
      }
      const double margin = circles ? 1 : 2;
      EXPECT_NEAR(print.high.x(), (.5 * n + (circles ? .5 : margin)) * cell, 1e-12);
      EXPECT_NEAR(print.high.y(), print.high.x(), 1e-12);  // as drawn
    }
}

TEST(FlatPrint, StretchedCirclesAreEllipses) {
  FlatPrint print = sheet(12 / 800.);
  print.stretch = {1.1, .95};
  const Moments seen = moments(photograph(view(), {print}, smooth()));
  EXPECT_NEAR(seen.area / (M_PI * 12 * 12 * 1.1 * .95), 1, 1e-4);
  EXPECT_LT((seen.center - Vector2d(50 + .0123 * 800, 50 - .0077 * 800)).norm(), 1e-3);
}

TEST(FlatPrint, SolidLightDiscsAreLighterThanThePaper) {
  calib::TargetDesign design;
  design.solid_light = true;
  const FlatPrint print = print_of(design, design.family.ids()[5]);
  EXPECT_EQ(print.shapes.size(), 25u);
  const auto cells = design.family.cells(design.family.ids()[5]);
  for (std::size_t i = 0; i < 25; ++i) {
    if (cells[i] == calib::Cell::light)
      EXPECT_GT(print.shapes[i].color.y(), print.paper.y() + .1);
    else
      EXPECT_LT(print.shapes[i].color.y(), print.paper.y() - .1);
  }
}

TEST(FlatPrint, RefusesWhatMakesNoPicture) {
  const auto code = [](View v, FlatPrint print, PrintPhotoOptions options) {
    return test::expect_error([&] { photograph_prints(v, std::vector{print}, kBlack, options, 1); }).code();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  View v = view();
  v.camera.f = 0;
  EXPECT_EQ(code(v, sheet(.01), {}), ErrorCode::bad_input);
  FlatPrint print = sheet(.01);
  print.shapes[0].radius = 0;  // and no polygon
  EXPECT_EQ(code(view(), print, {}), ErrorCode::invalid_argument);
  print = sheet(.01), print.high = print.low;
  EXPECT_EQ(code(view(), print, {}), ErrorCode::invalid_argument);
  print = sheet(.01), print.world_from_print.translation.x() = nan;
  EXPECT_EQ(code(view(), print, {}), ErrorCode::invalid_argument);
  PrintPhotoOptions options;
  options.blur_px = nan;
  EXPECT_EQ(code(view(), sheet(.01), options), ErrorCode::invalid_argument);
  options = {}, options.edge_samples = 0;
  EXPECT_EQ(code(view(), sheet(.01), options), ErrorCode::invalid_argument);
  calib::PointGrid grid;
  EXPECT_EQ(test::expect_error([&] { print_of(grid, kBlack, kWhite); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::rig
