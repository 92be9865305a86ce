#include "synthetic_views.h"

#include <lumihull/calib/circle_projection.h>

#include <cmath>

namespace lumihull::test {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Vector3d> plane_points(int columns, int rows, double spacing) {
  std::vector<Vector3d> points;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) points.emplace_back(x * spacing, y * spacing, 0);
  return points;
}

std::vector<Vector3d> box_points(int side, double spacing) {
  std::vector<Vector3d> points;
  for (int a = 0; a < side; ++a)
    for (int b = 0; b < side; ++b) {
      const double p = (a + 0.5) * spacing, q = (b + 0.5) * spacing;
      points.emplace_back(p, q, 0);
      points.emplace_back(p, 0, q);
      points.emplace_back(0, p, q);
    }
  return points;
}

Camera wide_camera() {
  Camera c;
  c.width = 1600;
  c.height = 1200;
  c.f = 1250;
  c.u0 = 812.5;
  c.v0 = 590.25;
  c.k1 = 0.12;
  c.k2 = -0.03;
  c.p1 = 4e-4;
  c.p2 = -7e-4;
  return c;
}

std::vector<calib::BoardView> make_views(const ViewMaker& maker, int count, std::uint64_t seed,
                                         std::vector<Pose>* poses) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> normal;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : maker.body) mean += p;
  mean /= double(maker.body.size());
  double extent = 0;
  for (const Vector3d& p : maker.body) extent = std::max(extent, (p - mean).norm());
  const Camera& camera = maker.camera;
  const double distance =
      maker.distance > 0 ? maker.distance : 1.25 * extent * 2 * camera.f / std::min(camera.width, camera.height);

  std::vector<calib::BoardView> views;
  for (int i = 0; i < count; ++i) {
    Pose pose;
    const Vector3d axis = Vector3d(unit(random), unit(random), 0).normalized();
    pose.rotation = Eigen::AngleAxisd(maker.tilt * (0.6 + 0.4 * unit(random)), axis) *
                    Eigen::AngleAxisd(0.5 * unit(random), Vector3d::UnitZ());
    const double d = distance * (1 + 0.15 * unit(random));
    const Vector3d middle(0.22 * d * camera.width / camera.f * unit(random), 0.22 * d * camera.height / camera.f * unit(random), d);
    pose.translation = middle - pose.rotation * mean;
    if (poses) poses->push_back(pose);
    calib::BoardView view;
    view.name = "view" + std::to_string(i);
    for (const Vector3d& p : maker.body) {
      calib::BoardMatch match;
      match.board = p;
      const Vector3d in_camera = pose * p;
      std::optional<Vector2d> pixel;
      if (maker.radius > 0) {
        match.radius = maker.radius;
        calib::Circle3 circle{in_camera, pose.rotation * Vector3d::UnitX(), pose.rotation * Vector3d::UnitY(), maker.radius};
        pixel = calib::projected_circle_center(camera, circle);
      } else {
        pixel = camera.project(in_camera);
      }
      const Vector2d noise(normal(random), normal(random));
      if (!pixel) continue;
      match.pixel = *pixel + maker.noise * noise;
      if (!camera.contains(match.pixel)) continue;
      if (maker.noise > 0) match.covariance *= maker.noise * maker.noise;
      view.matches.push_back(match);
    }
    views.push_back(std::move(view));
  }
  return views;
}

double largest_difference(const Camera& a, const Camera& b) {
  double largest = 0;
  for (int y = 0; y <= 12; ++y)
    for (int x = 0; x <= 16; ++x) {
      const Vector2d px(a.width * x / 16.0, a.height * y / 12.0);
      const auto ray = a.ray(px);
      const auto other = ray ? b.project(*ray) : std::nullopt;
      largest = std::max(largest, other ? (*other - px).norm() : INFINITY);
    }
  return largest;
}

}  // namespace lumihull::test
