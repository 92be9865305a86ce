#include "simulated_capture.h"

#include <lumihull/calib/circle_projection.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <numbers>
#include <random>

namespace lumihull::test {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<calib::CameraStart> SimulatedCapture::cameras(bool known) const {
  calib::CameraStart start;
  start.width = camera.width, start.height = camera.height;
  if (known) start.camera = camera;
  return {start};
}

std::optional<calib::Detection> see_target(const calib::TargetSet& set, int id, const Pose& world_from_target,
                                           const View& view, double noise_px, std::uint64_t seed) {
  const calib::TargetDesign& design = set.designs[0];
  const Pose cam_from_target = view.cam_from_world * world_from_target;
  const Eigen::Matrix3d r = cam_from_target.rotation.toRotationMatrix();
  const Vector3d middle = cam_from_target.translation;
  if (!(middle.z() > 0.1) || r.col(2).dot(middle.normalized()) < 0.35)
    return std::nullopt;  // from behind, or beyond 70 degrees
  calib::Detection d;
  d.id = id;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  std::vector<Vector2d> plane, pixels;
  for (int i = 0; i < design.features(); ++i) {
    const Vector2d place = design.feature(i);
    const double radius = design.family.kind() == calib::TargetKind::circles ? design.circle_radius_m() : 0;
    const calib::Circle3 circle{cam_from_target * Vector3d(place.x(), place.y(), 0), r.col(0), r.col(1), radius};
    const auto pixel = calib::projected_circle_center(view.camera, circle);
    if (!pixel || pixel->x() < 8 || pixel->y() < 8 || pixel->x() > view.camera.width - 8 ||
        pixel->y() > view.camera.height - 8)
      return std::nullopt;
    calib::Feature f;
    f.index = i;
    f.pixel = *pixel + Vector2d(noise(random), noise(random));
    f.covariance = std::max(1e-6, noise_px * noise_px) * Eigen::Matrix2d::Identity();
    d.features.push_back(f);
    plane.push_back(place);
    pixels.push_back(f.pixel);
  }
  d.pixel_from_target = calib::find_homography(plane, pixels);
  return d;
}

SimulatedCapture simulate_capture(const SimulatedOptions& o) {
  SimulatedCapture c;
  c.set = calib::TargetSet::from_word(o.family);
  c.camera.width = 3000, c.camera.height = 2000;
  c.camera.f = 2400, c.camera.u0 = 1510, c.camera.v0 = 985;
  c.camera.k1 = 0.05, c.camera.k2 = -0.02, c.camera.p1 = 0.0005, c.camera.p2 = -0.0004;
  c.camera.s = o.s, c.camera.k3 = o.k3;
  std::mt19937_64 random(o.seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto facing = [&](const Vector3d& place, const Vector3d& normal) {
    // z into the paper; turned by any angle.
    const double turn = 2 * std::numbers::pi * unit(random);
    const Vector3d z = -normal, side = std::abs(z.z()) > 0.9 ? Vector3d::UnitX() : Vector3d::UnitZ();
    const Vector3d x0 = side.cross(z).normalized(), y0 = z.cross(x0);
    const Vector3d x = std::cos(turn) * x0 + std::sin(turn) * y0;
    Eigen::Matrix3d rotation;
    rotation << x, z.cross(x), z;
    return Pose::from_matrix(rotation, place);
  };
  for (int id = 0; id < o.targets; ++id) {
    const double turn = 2 * std::numbers::pi * (id + 0.5 * unit(random)) / o.targets;
    if (o.floor_only || id % 2 == 0) {
      const double r =
          o.floor_only ? 0.15 + 0.25 * (id % 3) + 0.1 * unit(random) : o.room_m * (0.06 + 0.9 * unit(random));
      c.world_from_target.push_back(facing({r * std::cos(turn), r * std::sin(turn), 0}, Vector3d::UnitZ()));
    } else {
      const Vector3d out(std::cos(turn), std::sin(turn), 0);
      c.world_from_target.push_back(facing(o.room_m * out + Vector3d(0, 0, 0.2 + 1.5 * unit(random)), -out));
    }
  }
  for (int i = 0; i < o.photos; ++i) {
    const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * i, up = 0.15 + 0.75 * (i + 0.5) / o.photos;
    const double across = std::sqrt(1 - up * up);
    const Vector3d eye = o.radius_m * Vector3d(across * std::cos(turn), across * std::sin(turn), up);
    const Vector3d aim(0.1 * unit(random) - 0.05, 0.1 * unit(random) - 0.05, 0.1 * unit(random));
    const Pose pose = look_at(eye, aim, {0, 0, 1});
    c.cam_from_world.push_back(pose);
    calib::PhotoTargets photo;
    char name[16];
    std::snprintf(name, sizeof name, "%04d", i + 1);
    photo.name = name;
    photo.shot = i;
    for (int id = 0; id < o.targets; ++id)
      if (auto d = see_target(c.set, id, c.world_from_target[std::size_t(id)], {c.camera, pose}, o.noise_px,
                              o.seed * 1000003 + std::uint64_t(i) * 1009 + std::uint64_t(id)))
        photo.targets.push_back(std::move(*d));
    c.photos.push_back(std::move(photo));
  }
  return c;
}

PoseErrors pose_errors(const SimulatedCapture& truth, const calib::Calibration& answer) {
  std::vector<Vector3d> a, b;
  std::vector<std::size_t> photos;
  for (std::size_t i = 0; i < answer.photos.size(); ++i)
    if (answer.photos[i].part == 0) {
      a.push_back(answer.photos[i].cam_from_world->center());
      b.push_back(truth.cam_from_world[i].center());
      photos.push_back(i);
    }
  PoseErrors errors;
  errors.photos = int(a.size());
  if (a.empty()) return errors;
  // Rotation by the cameras' own: three centres on a line would leave it open.
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const std::size_t i : photos)
    sum +=
        (truth.cam_from_world[i].rotation.conjugate() * answer.photos[i].cam_from_world->rotation).toRotationMatrix();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  Vector3d shift(0, 0, 0);
  for (std::size_t k = 0; k < a.size(); ++k) shift += (b[k] - turn * a[k]) / double(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    errors.centre_m += (turn * a[k] + shift - b[k]).squaredNorm();
    const Eigen::Quaterniond left = truth.cam_from_world[photos[k]].rotation * Eigen::Quaterniond(turn);
    const double angle = left.angularDistance(answer.photos[photos[k]].cam_from_world->rotation);
    errors.angle += angle * angle;
  }
  errors.centre_m = std::sqrt(errors.centre_m / double(a.size()));
  errors.angle = std::sqrt(errors.angle / double(a.size()));
  return errors;
}

}  // namespace lumihull::test
