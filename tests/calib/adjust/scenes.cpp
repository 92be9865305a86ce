#include "scenes.h"

#include <lumihull/calib/circle_projection.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace lumihull::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double normal() { return normal_(engine_); }
  double uniform(double low, double high) { return low + (high - low) * uniform_(engine_); }
  Vector3d normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

/// y = scale · turn · x + shift, least squares.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Vector3d shift{0, 0, 0};
  Similarity(const std::vector<Vector3d>& x, const std::vector<Vector3d>& y) {
    Vector3d mean_x = Vector3d::Zero(), mean_y = Vector3d::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) mean_x += x[i] / double(x.size()), mean_y += y[i] / double(x.size());
    Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
    double extent = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      product += (y[i] - mean_y) * (x[i] - mean_x).transpose();
      extent += (x[i] - mean_x).squaredNorm();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    turn = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    scale = svd.singularValues().dot(signs) / extent;
    shift = mean_y - scale * turn * mean_x;
  }
};

Pose nudged(const Pose& pose, double angle, double shift, Dice& dice) {
  const Vector3d turn = angle * dice.normal3();
  const Vector3d by = shift * dice.normal3();
  const Eigen::Quaterniond q(Eigen::AngleAxisd(turn.norm(), turn.norm() > 0 ? turn.normalized() : Vector3d::UnitX()));
  return {(q * pose.rotation).normalized(), pose.translation + by};
}

std::vector<calib::BodyPoint> grid_points(const SceneMaker& maker) {
  std::vector<calib::BodyPoint> points;
  for (int row = 0; row < maker.side; ++row)
    for (int column = 0; column < maker.side; ++column) {
      calib::BodyPoint point;
      point.place = {maker.pitch * column, maker.pitch * row, 0};
      point.radius = maker.radius;
      points.push_back(point);
    }
  return points;
}

void add_bodies(const SceneMaker& maker, calib::Adjustment& truth, Dice& dice) {
  for (int i = 0; i < maker.bodies; ++i) {
    calib::AdjustedBody body;
    body.name = "target " + std::to_string(i);
    body.points = grid_points(maker);
    body.model = maker.model;
    const double angle = 2 * std::numbers::pi * i / maker.bodies, out = maker.ring * dice.uniform(0.9, 1.1);
    const Vector3d place(out * std::cos(angle), out * std::sin(angle), dice.uniform(0, 0.3));
    const Vector3d axis = Vector3d(dice.normal(), dice.normal(), 0).normalized();
    body.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(dice.uniform(0, 0.6), axis) *
                                               Eigen::AngleAxisd(dice.uniform(-3, 3), Vector3d::UnitZ())),
                            place};
    if (maker.model == calib::BodyModel::bending) body.bend = maker.bend * dice.normal3();
    if (maker.model == calib::BodyModel::free)
      for (const calib::BodyPoint& point : body.points)
        body.free_places.push_back(body.world_from_body * point.place + 5e-4 * dice.normal3());
    truth.bodies.push_back(std::move(body));
  }
}

/// Cosine of the angle between a circle's normal and the line of sight. Nobody measures an ellipse seen from its edge,
/// and nobody predicts it: it is thinner than the lens bends it.
double slant(const calib::Adjustment& state, const calib::Observation& o) {
  const calib::AdjustedBody& body = state.bodies[o.body];
  const Pose pose = state.cameras[o.camera].cam_from_rig * state.shots[o.shot].rig_from_world;
  return std::abs((pose.rotation * (body.world_from_body.rotation * body.points[o.point].normal))
                      .dot((pose * body.point(o.point)).normalized()));
}

void add_observations(const SceneMaker& maker, calib::Adjustment& truth, Dice& dice) {
  for (std::size_t s = 0; s < truth.shots.size(); ++s)
    for (std::size_t c = 0; c < truth.cameras.size(); ++c)
      for (std::size_t b = 0; b < truth.bodies.size(); ++b) {
        if (maker.seen < 1 && dice.uniform(0, 1) > maker.seen && b != s % truth.bodies.size()) continue;
        for (std::size_t i = 0; i < truth.bodies[b].points.size(); ++i) {
          calib::Observation o;
          o.shot = std::uint32_t(s), o.camera = std::uint32_t(c), o.body = std::uint32_t(b), o.point = std::uint32_t(i);
          const Vector2d pixel = predicted_pixel(truth, o);
          const double tilt = dice.uniform(-0.4, 0.4), along = dice.uniform(0.7, 1.4);
          const Vector2d noise(dice.normal(), dice.normal());
          if (maker.radius > 0 && slant(truth, o) < 0.2) continue;
          if (!pixel.allFinite() || (maker.inside && !truth.cameras[c].camera.contains(pixel))) continue;
          Eigen::Matrix2d root;
          root << along, 0, tilt, 1 / along;
          const double size = maker.noise > 0 ? maker.noise : 1;
          o.covariance = size * size * root * root.transpose();
          o.pixel = maker.noise > 0 ? Vector2d(pixel + size * root * noise) : pixel;
          truth.observations.push_back(o);
        }
      }
}

}  // namespace

Camera scene_camera() {
  Camera c;
  c.width = 3600, c.height = 2400;
  c.f = 3000;
  c.u0 = 1807, c.v0 = 1195;
  c.k1 = 0.08, c.k2 = -0.02, c.p1 = 3e-4, c.p2 = -4e-4;
  return c;
}

Vector2d predicted_pixel(const calib::Adjustment& state, const calib::Observation& o) {
  const calib::AdjustedBody& body = state.bodies[o.body];
  const Pose cam_from_world = state.cameras[o.camera].cam_from_rig * state.shots[o.shot].rig_from_world;
  const calib::BodyPoint& point = body.points[o.point];
  calib::Circle3 circle;
  circle.center = cam_from_world * body.point(o.point, state.print_scale);
  circle.radius = point.radius * state.print_scale.mean();
  Vector3d normal = point.normal;
  if (body.model == calib::BodyModel::bending) {
    // By differences over the surface: independent of the library's formula.
    const auto height = [&](double dx, double dy) {
      Vector3d mean = Vector3d::Zero();
      for (const auto& p : body.points) mean += p.place / double(body.points.size());
      const double x = state.print_scale.x() * (point.place.x() - mean.x()) + dx;
      const double y = state.print_scale.y() * (point.place.y() - mean.y()) + dy;
      return body.bend.x() * x * x + body.bend.y() * x * y + body.bend.z() * y * y;
    };
    const double h = 1e-4;
    normal = Vector3d(1, 0, (height(h, 0) - height(-h, 0)) / (2 * h))
                 .cross(Vector3d(0, 1, (height(0, h) - height(0, -h)) / (2 * h)))
                 .normalized();
  }
  Eigen::Matrix3d world_from_body = body.world_from_body.rotation.toRotationMatrix();
  if (body.model == calib::BodyModel::free && point.radius > 0) {
    std::vector<Vector3d> printed;
    for (const calib::BodyPoint& p : body.points) printed.push_back(p.place);
    const Similarity fit(printed, body.free_places);
    world_from_body = fit.turn;
    circle.radius = point.radius * fit.scale;
  }
  normal = cam_from_world.rotation * (world_from_body * normal);
  circle.u = normal.unitOrthogonal();
  circle.v = normal.cross(circle.u);
  const auto pixel = calib::projected_circle_center(state.cameras[o.camera].camera, circle);
  return pixel ? *pixel : Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
}

Scene make_scene(const SceneMaker& maker, std::uint64_t seed) {
  Dice dice(seed);
  Scene scene;
  calib::Adjustment& truth = scene.truth;
  truth.print_scale = maker.print_scale;
  truth.free_print_scale = maker.bars > 0 && maker.model != calib::BodyModel::free;
  for (int c = 0; c < maker.cameras; ++c) {
    calib::AdjustedCamera camera;
    camera.camera = scene_camera();
    camera.camera.f += 30 * c;
    if (maker.free_lens) camera.free = {true, false, false, true, true, true, true, false, true, true};
    if (c > 0) {
      camera.cam_from_rig = {Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vector3d::UnitY())), Vector3d(-0.2, 0.01, 0.02)};
      camera.on_rig = true;
    }
    truth.cameras.push_back(camera);
  }
  add_bodies(maker, truth, dice);
  for (int s = 0; s < maker.shots; ++s) {
    const double elevation = dice.uniform(0.35, 1.45), around = 2.39996 * s, distance = dice.uniform(0.8, 2.7);
    const Vector3d eye = distance * Vector3d(std::cos(around) * std::cos(elevation),
                                             std::sin(around) * std::cos(elevation), std::sin(elevation)) +
                         Vector3d(0, 0, 0.3);
    const Vector3d target = 0.1 * dice.normal3();
    const double roll = dice.uniform(-3, 3);
    Pose pose = look_at(eye, target, {0, 0, 1});
    pose = Pose{Eigen::Quaterniond(Eigen::AngleAxisd(roll, Vector3d::UnitZ())), Vector3d::Zero()} * pose;
    truth.shots.push_back({"shot " + std::to_string(s), pose});
  }
  add_observations(maker, truth, dice);
  for (int i = 0; i < maker.bars; ++i) {
    calib::ScaleBar bar;
    bar.name = "bar " + std::to_string(i);
    bar.body_a = std::uint32_t(2 * i), bar.body_b = std::uint32_t(2 * i + 1);
    bar.sigma_m = 1e-5;
    bar.length_m =
        (truth.bodies[bar.body_b].point(0, truth.print_scale) - truth.bodies[bar.body_a].point(0, truth.print_scale))
            .norm() +
        (maker.noise > 0 ? bar.sigma_m * dice.normal() : 0);
    truth.bars.push_back(bar);
  }

  scene.start = truth;
  const double off = maker.off;
  if (off <= 0) return scene;
  for (calib::AdjustedShot& shot : scene.start.shots)
    shot.rig_from_world = nudged(shot.rig_from_world, 5e-3 * off, 5e-3 * off, dice);
  for (calib::AdjustedBody& body : scene.start.bodies) {
    body.world_from_body = nudged(body.world_from_body, 5e-3 * off, 5e-3 * off, dice);
    body.bend.setZero();
    for (Vector3d& place : body.free_places) place += 2e-3 * off * dice.normal3();
  }
  for (calib::AdjustedCamera& camera : scene.start.cameras) {
    if (camera.on_rig) camera.cam_from_rig = nudged(camera.cam_from_rig, 5e-3 * off, 5e-3 * off, dice);
    if (!maker.free_lens) continue;
    camera.camera.f *= 1 + 0.01 * off;
    camera.camera.k1 = camera.camera.k2 = camera.camera.p1 = camera.camera.p2 = 0;
  }
  scene.start.print_scale = {1, 1};
  return scene;
}

double point_rms(const calib::Adjustment& a, const calib::Adjustment& b, bool best) {
  std::vector<Vector3d> x, y;
  for (std::size_t i = 0; i < a.bodies.size(); ++i)
    for (std::size_t k = 0; k < a.bodies[i].points.size(); ++k) {
      x.push_back(a.bodies[i].point(k, a.print_scale));
      y.push_back(b.bodies[i].point(k, b.print_scale));
    }
  const Similarity fit(x, y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    sum += ((best ? Vector3d(fit.scale * (fit.turn * x[i]) + fit.shift) : x[i]) - y[i]).squaredNorm();
  return std::sqrt(sum / double(x.size()));
}

}  // namespace lumihull::test
