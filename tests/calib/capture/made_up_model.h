#pragma once

// A calibration that nobody measured, with something in every field.

#include <lumihull/calib/target_model.h>

#include <cmath>
#include <numbers>
#include <random>
#include <type_traits>

namespace lumihull::test {

/// `photos` cameras on a dome around `targets` targets; residuals of 0.05 px that grow towards the picture's border.
inline calib::TargetModel made_up_model(int photos = 8, int targets = 4) {
  using namespace calib;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto covariance = [&]<int N>(std::integral_constant<int, N>, double sigma) {
    using Matrix = Eigen::Matrix<double, N, N>;
    Matrix a = Matrix::Zero();
    for (int i = 0; i < N * N; ++i) a(i / N, i % N) = sigma * normal(random);
    const Matrix product = a * a.transpose() + sigma * sigma * Matrix::Identity();
    return Matrix(0.5 * (product + product.transpose()));  // to the last digit
  };
  TargetModel model;
  model.set = TargetSet::from_word("matrix5x5:18mm");
  Camera camera{.width = 1500, .height = 1000, .f = 1800, .u0 = 760, .v0 = 490, .k1 = -0.05};
  model.starts = {{1500, 1000, camera, 0}, {1500, 1000, std::nullopt, 1700}};
  Calibration& c = model.calibration;
  c.cameras = {camera, camera};
  c.camera_covariances = {Eigen::Matrix<double, kIntrinsics, kIntrinsics>::Zero(),
                          Eigen::Matrix<double, kIntrinsics, kIntrinsics>::Zero()};
  c.camera_covariances[0](0, 0) = 0.04;
  const TargetDesign& design = model.set.designs[0];
  for (int t = 0; t < targets; ++t) {
    CalibratedBody body;
    body.name = "matrix5x5 " + std::to_string(t);
    body.design = 0, body.id = t;
    body.placed = t + 1 < targets || targets < 3;
    body.photos = photos;
    body.rms_px = 0.04 + 0.01 * t;
    body.body.model = t == 1 ? BodyModel::bending : BodyModel::rigid;
    if (t == 1) body.body.bend = {0.1, 0, -0.05};
    body.body.name = body.name;
    const double turn = 2 * std::numbers::pi * t / targets;
    if (body.placed) body.part = 0;
    if (body.placed)
      body.body.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX())),
                                   {0.3 * std::cos(turn), 0.3 * std::sin(turn), 0.01 * t}};
    for (int k = 0; k < design.features(); ++k) {
      body.features.push_back({0, t, k});
      const Eigen::Vector2d place = design.feature(k);
      body.body.points.push_back({{place.x(), place.y(), 0}, design.circle_radius_m(), {0, 0, 1}});
      if (!body.placed) continue;
      body.points.push_back(body.body.point(std::size_t(k)));
      body.point_covariances.push_back(covariance(std::integral_constant<int, 3>(), 2e-5));
    }
    c.bodies.push_back(std::move(body));
  }
  for (int i = 0; i < photos; ++i) {
    model.photos.push_back({"p" + std::to_string(i), i % 2});
    CalibratedPhoto photo;
    const double turn = 2 * std::numbers::pi * i / photos, up = 0.4 + 0.8 * (i % 5) / 5;
    if (i != 2) {
      photo.cam_from_world = look_at({1.2 * std::cos(turn) * std::cos(up), 1.2 * std::sin(turn) * std::cos(up), 1.2 * std::sin(up)},
                                     {0, 0, 0}, {0, 0, 1});
      photo.covariance = covariance(std::integral_constant<int, 6>(), 4e-5);
      photo.points = 60;
      photo.rms_px = 0.05 + 0.01 * (i % 4);
    }
    photo.in_model = i % 3 != 2;
    photo.part = i == 2 ? -1 : 0;
    photo.reason = i == 2 ? "shows no target" : photo.in_model ? "many points" : "placed by resection";
    if (photo.cam_from_world)
      for (int b = 0; b < targets; ++b)
        for (std::size_t k = 0; k < c.bodies[std::size_t(b)].points.size(); ++k) {
          const auto pixel = View{camera, *photo.cam_from_world}.project(c.bodies[std::size_t(b)].points[k]);
          if (!pixel || !camera.contains(*pixel)) continue;
          CalibrationResidual r;
          r.photo = i, r.body = b, r.point = int(k);
          r.pixel = *pixel;
          const double out = (*pixel - Eigen::Vector2d(750, 500)).norm() / 900;
          r.error = Eigen::Vector2d(normal(random), normal(random)) * (0.03 + 0.06 * out) + Eigen::Vector2d(0.03 * out, 0);
          r.removed = c.residuals.size() % 97 == 5;
          if (r.removed) r.error *= 30;
          r.sigmas = r.error.norm() / 0.04;
          r.size_px = 8 + 6 * std::abs(normal(random));
          c.residuals.push_back(r);
        }
    c.photos.push_back(std::move(photo));
  }
  c.removed = {{Removed::Kind::observation, Removed::Why::outlier, 1, 0, 0, 0, 7, 2.5, "p1: matrix5x5 0, circle 7 is 2.5 px off"},
               {Removed::Kind::detection, Removed::Why::wrong_id, 3, -1, 0, 200, -1, 0, "p3: matrix5x5 200 is not in the model"},
               {Removed::Kind::photo, Removed::Why::too_few, 2, -1, -1, -1, -1, 0, "p2 shows too few points"}};
  c.rms_px = 0.061, c.share = 0.99, c.sigma0 = 1.07, c.parts = 1;
  c.print_scale = {1.001, 0.999};
  c.cross_validation_m = 2.1e-5, c.cross_validation_sigma = 1.1, c.bend_m = 0.0004;
  c.warnings = {"The picture's corners show no targets: turn the camera on its side for some photographs."};
  c.verdict = "Good: 7 of 8 photographs placed, residuals as the covariances expect.";
  return model;
}

}  // namespace lumihull::test
