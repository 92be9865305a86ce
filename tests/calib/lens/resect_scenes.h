#pragma once

#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace lumihull::test {

/// Matches of known truth.
struct ResectScene {
  Camera camera;
  Pose cam_from_world;
  std::vector<calib::PointMatch> matches;
  std::vector<std::uint32_t> wrong;  ///< ascending
};

struct ResectSceneOptions {
  int points = 50;
  bool planar = false;
  bool distorted = true;
  bool circles = false;
  double noise_px = 0;          ///< standard deviation; the covariances vary about it, and are right
  double wrong_share = 0;       ///< of the matches
  double wrong_px = 500;        ///< how far they are off, at most
  double size_m = 1;            ///< of the body, RMS about
  double distance = 4;          ///< in sizes, about
  Eigen::Vector3d at{0, 0, 0};  ///< the body's centre in the world
};

inline ResectScene resect_scene(std::uint64_t seed, const ResectSceneOptions& o) {
  std::mt19937_64 random(seed * 7919 + 17);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  std::normal_distribution<double> normal;
  ResectScene s;
  s.camera = {.width = 3072, .height = 2048, .f = 2800, .s = 1.01, .skew = 3, .u0 = 1550, .v0 = 1010};
  if (o.distorted) s.camera.k1 = 0.1, s.camera.k2 = -0.03, s.camera.p1 = 0.001, s.camera.p2 = -0.0007;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  for (;;) {  // the camera: somewhere around, all in the picture
    const Eigen::Vector3d to =
        Eigen::Vector3d(uniform(-0.25, 0.25), uniform(-0.15, 0.15), 1) * uniform(0.8, 1.2) * o.distance * o.size_m;
    Eigen::Matrix3d r = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                            .normalized()
                            .toRotationMatrix();
    if (o.planar && std::abs((r.col(2)).dot(to.normalized())) < 0.4) continue;  // flatter than 66 degrees
    s.cam_from_world = {Eigen::Quaterniond(r), to};
    break;
  }
  // World: turned and moved, so that nothing is aligned with its axes.
  const Pose body_from_world{turn.conjugate(), -(turn.conjugate() * o.at)};
  s.cam_from_world = s.cam_from_world * body_from_world;
  for (int i = 0; i < o.points; ++i) {
    calib::PointMatch m;
    Eigen::Vector3d body(uniform(-1, 1), uniform(-1, 1), o.planar ? 0 : uniform(-1, 1));
    if (o.points == 4 && o.planar) body = Eigen::Vector3d(i % 2 ? 1 : -1, i / 2 ? 1 : -1, 0) + 0.2 * body;
    body *= o.size_m * 0.8;
    m.world = turn * body + o.at;
    std::optional<Eigen::Vector2d> pixel;
    if (o.circles) {
      m.radius = 0.04 * o.size_m;
      // Facing the camera within 65 degrees, or the plane's
      const Eigen::Matrix3d r = s.cam_from_world.rotation.toRotationMatrix();
      const Eigen::Vector3d in_camera = s.cam_from_world * m.world;
      Eigen::Vector3d n =
          o.planar ? turn * Eigen::Vector3d::UnitZ()
                   : r.transpose() *
                         (-in_camera.normalized() + Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), 0)).normalized();
      m.normal = n.normalized();
      const Eigen::Vector3d nc = r * m.normal;
      const Eigen::Vector3d u = nc.unitOrthogonal();
      pixel = calib::projected_circle_center(s.camera, {in_camera, u, nc.cross(u), m.radius});
    } else {
      pixel = s.camera.project(s.cam_from_world * m.world);
    }
    m.pixel = pixel.value();
    if (o.noise_px > 0) {
      const double a = o.noise_px * uniform(0.6, 1.4), b = o.noise_px * uniform(0.6, 1.4), t = uniform(0, 3.14);
      Eigen::Matrix2d axes = Eigen::Rotation2Dd(t).toRotationMatrix();
      m.covariance = axes * Eigen::Vector2d(a * a, b * b).asDiagonal() * axes.transpose();
      m.pixel += axes * Eigen::Vector2d(a * normal(random), b * normal(random));
    }
    if (i < std::lround(o.wrong_share * o.points)) {
      const Eigen::Vector2d off =
          o.wrong_px * uniform(0.1, 1) * Eigen::Vector2d(normal(random), normal(random)).normalized();
      m.pixel += off;
    }
    s.matches.push_back(m);
  }
  // Wrong ones anywhere among the others.
  std::vector<std::uint32_t> order(s.matches.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = std::uint32_t(i);
  std::shuffle(order.begin(), order.end(), random);
  std::vector<calib::PointMatch> shuffled;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i] < std::lround(o.wrong_share * o.points)) s.wrong.push_back(std::uint32_t(i));
    shuffled.push_back(s.matches[order[i]]);
  }
  s.matches = std::move(shuffled);
  return s;
}

/// (rotation vector, translation) of a motion that makes b of a: exp(motion) a = b.
inline Eigen::Matrix<double, 6, 1> motion_between(const Pose& a, const Pose& b) {
  const Eigen::AngleAxisd turn(b.rotation * a.rotation.conjugate());
  Eigen::Matrix<double, 6, 1> m;
  m << turn.angle() * turn.axis(), b.translation - turn * a.translation;
  return m;
}

inline double angle_between(const Pose& a, const Pose& b) { return motion_between(a, b).head<3>().norm(); }

}  // namespace lumihull::test
