#include "target_scene.h"

#include <lumihull/calib/circle_projection.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::test {

using calib::TargetDesign;
using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

Pose pose_of(const Camera& camera, const TargetDesign& design, const Lie& lie) {
  const Vector3d ray = camera.ray(lie.pixel).value().normalized();
  const double distance = 2 * design.circle_radius_m() * camera.f * std::cos(lie.tilt) / lie.minor_px;
  Pose pose;
  pose.rotation =
      (Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), ray) * AngleAxisd(lie.azimuth, Vector3d::UnitZ()) *
       AngleAxisd(lie.tilt, Vector3d::UnitX()) * AngleAxisd(lie.roll - lie.azimuth, Vector3d::UnitZ()))
          .normalized();
  pose.translation = distance * ray;
  return pose;
}

Image photograph(const Camera& camera, const std::vector<TargetDesign>& designs,
                 const std::vector<PlacedTarget>& targets, const Eigen::Vector3f& background,
                 const rig::PrintPhotoOptions& options, std::uint64_t seed) {
  std::vector<rig::FlatPrint> prints;
  for (const PlacedTarget& t : targets) {
    prints.push_back(rig::print_of(designs[std::size_t(t.design)], t.id));
    prints.back().world_from_print = t.cam_from_target;
  }
  return rig::photograph_prints({camera, Pose{}}, prints, background, options, seed);
}

TargetDesign design_of(const std::string& family) {
  TargetDesign design;
  design.family = calib::TargetFamily::by_name(family);
  return design;
}

Camera part_of_camera(int width, int height, double f, const Vector2d& principal_point) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.f = f;
  camera.u0 = principal_point.x(), camera.v0 = principal_point.y();
  return camera;
}

OneTarget one_target(const TargetDesign& design, double minor_px, double tilt, const rig::PrintPhotoOptions& options,
                     std::uint64_t seed, const Eigen::Vector3f& background) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) { return low + (high - low) * double(random() >> 11) * 0x1p-53; };
  const double pitch_px = minor_px / std::cos(tilt) * design.size_m / (2 * design.circle_radius_m());
  const int side = int(pitch_px * (design.family.grid() + 1) * 1.5) + 24;
  OneTarget one;
  // The lens sees far more than 5 pitches: 12 megapixels with a normal lens, or as much as the target needs.
  const double f = std::max(4000.0, 12.0 * pitch_px);
  one.camera = part_of_camera(side, side, f, {0.5 * side + uniform(-.4, .4) * f, 0.5 * side + uniform(-.3, .3) * f});
  const std::span<const int> ids = design.family.ids();
  one.target.id = ids[random() % ids.size()];
  Lie lie;
  lie.pixel = {0.5 * side + uniform(-1, 1), 0.5 * side + uniform(-1, 1)};
  lie.minor_px = minor_px;
  lie.tilt = tilt;
  lie.azimuth = uniform(0, 2 * std::numbers::pi);
  lie.roll = uniform(0, 2 * std::numbers::pi);
  one.target.cam_from_target = pose_of(one.camera, design, lie);
  one.photo = photograph(one.camera, {design}, {one.target}, background, options, seed);
  return one;
}

Vector2d true_center(const Camera& camera, const TargetDesign& design, const PlacedTarget& truth, int feature) {
  const Vector2d p = design.feature(feature);
  calib::Circle3 circle;
  circle.center = truth.cam_from_target * Vector3d(p.x(), p.y(), 0);
  circle.u = truth.cam_from_target.rotation * Vector3d::UnitX();
  circle.v = truth.cam_from_target.rotation * Vector3d::UnitY();
  circle.radius = design.circle_radius_m();
  return calib::projected_circle_center(camera, circle).value();
}

double center_error(const Camera& camera, const TargetDesign& design, const PlacedTarget& truth,
                    const calib::Detection& found) {
  double sum = 0;
  for (const calib::Feature& f : found.features)
    sum += (true_center(camera, design, truth, f.index) - f.pixel).squaredNorm();
  return found.features.empty() ? -1 : std::sqrt(sum / double(found.features.size()));
}

}  // namespace lumihull::test
