#include "target_shot.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace lumihull::test {

namespace {

using calib::TargetDesign;
using calib::TargetKind;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// A 10 mm lens before 22.7 mm of 4000 x 3000 pixels; distortion of 8 % in the corners.
Camera wide_camera() {
  Camera c;
  c.width = 4000, c.height = 3000;
  c.f = 4000 * 10 / 22.7;
  c.u0 = 2000, c.v0 = 1500;
  c.k1 = .06, c.k2 = -.008, c.p1 = .0008, c.p2 = -.0005;
  return c;
}

Vector3f random_color(Dice& dice) {
  const double grey = dice.between(.04, .7);
  Vector3f c;
  for (int i = 0; i < 3; ++i) c[i] = float(grey * dice.between(.6, 1.2));
  return c.cwiseMin(1.f);
}

/// Puts the target before the camera at a place in the picture: tilted against the line of sight, turned, at a depth.
Pose place(const Camera& camera, const Vector2d& pixel, double depth, double tilt, Dice& dice) {
  const Vector3d ray = camera.ray(pixel).value().normalized();
  const Eigen::Quaterniond sight = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), ray);
  const double axis = dice.between(0, 2 * M_PI), turn = dice.between(0, 2 * M_PI);
  const Eigen::AngleAxisd tilted(tilt, Vector3d(std::cos(axis), std::sin(axis), 0));
  return {(sight * tilted * Eigen::AngleAxisd(turn, Vector3d::UnitZ())).normalized(), ray * depth};
}

}  // namespace

std::uint64_t Dice::next() {
  state_ += 0x9e3779b97f4a7c15ull;
  std::uint64_t x = state_;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

double outer_size(const TargetDesign& design) {
  return design.family.kind() == TargetKind::circles
             ? (design.family.grid() - 1) * design.size_m + 2 * design.circle_radius_m()
             : design.size_m;
}

TargetDesign sized(TargetDesign design, double outer_m) {
  const double factor = outer_m / outer_size(design);
  design.size_m *= factor, design.circle_diameter_m *= factor, design.ring_diameter_m *= factor;
  return design;
}

TargetShot photograph_target(TargetDesign design, int id, const Seen& seen, std::uint64_t seed) {
  Dice dice(seed);
  TargetShot shot;
  shot.id = id;
  const bool circles = design.family.kind() == TargetKind::circles;
  const double circle = circles ? 2 * design.circle_radius_m() : outer_size(design) / 9;  // 5x5: 4.5 pitches of 2
  const double sheet = outer_size(design) * (circles ? 1.35 : 1.6);

  Camera camera = wide_camera();
  if (!seen.wide) camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0, camera.f = 4000;
  // Room for the sheet as seen straight, and some.
  const double depth = circle * camera.f * std::cos(seen.tilt_rad) / seen.minor_px;
  const double extent = sheet * camera.f / depth;
  // Where in the whole picture: for a wide lens in the outer half, as far as it fits.
  const double half = .5 * extent;
  Vector2d pixel(2000, 1500);
  if (seen.wide) {
    const double angle = dice.between(0, 2 * M_PI), radius = dice.between(.5, 1);
    const Vector2d room(std::max(0., 2000 - half), std::max(0., 1500 - half));
    pixel += Vector2d(std::cos(angle) * room.x(), std::sin(angle) * room.y()) * radius;
  } else {
    pixel += Vector2d(dice.between(-400, 400), dice.between(-400, 400));
  }
  pixel += Vector2d(dice.unit(), dice.unit());
  Pose pose = place(camera, pixel, depth, seen.tilt_rad, dice);

  // The part of the picture that holds the sheet.
  rig::FlatPrint print = rig::print_of(design, id);
  print.world_from_print = pose;
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i < 32; ++i) {
    const double t = 8 * (i % 8) / 64.;
    const Vector2d a = print.low, b = print.high;
    const Vector2d p = i < 8    ? Vector2d(a.x() + t * (b.x() - a.x()), a.y())
                       : i < 16 ? Vector2d(b.x(), a.y() + t * (b.y() - a.y()))
                       : i < 24 ? Vector2d(b.x() - t * (b.x() - a.x()), b.y())
                                : Vector2d(a.x(), b.y() - t * (b.y() - a.y()));
    if (const auto px = camera.project(pose * Vector3d(p.x(), p.y(), 0)))
      low = low.cwiseMin(*px), high = high.cwiseMax(*px);
  }
  const double margin = dice.between(4, 30);
  const int x0 = int(std::floor(low.x() - margin)), y0 = int(std::floor(low.y() - margin));
  camera.width = std::clamp(int(std::ceil(high.x() + margin)) - x0, 32, 4000);
  camera.height = std::clamp(int(std::ceil(high.y() + margin)) - y0, 32, 4000);
  camera.u0 -= x0, camera.v0 -= y0;

  std::vector<rig::FlatPrint> prints{print};
  if (seen.occluded) {
    rig::FlatPrint bar;
    const double across = outer_size(design);
    bar.low = Vector2d(dice.between(-.5, .4), -1) * across;
    bar.high = Vector2d(bar.low.x() / across + dice.between(.05, .3), 1) * across;
    bar.paper = random_color(dice);
    bar.world_from_print = pose * Pose{Eigen::Quaterniond(Eigen::AngleAxisd(dice.between(0, 6.3), Vector3d::UnitZ())),
                                       Vector3d(0, 0, -.02 * across)};
    prints.push_back(bar);
  }

  rig::PrintPhotoOptions options;
  options.blur_px = seen.blur_px;
  options.exposure = dice.between(.5, 1.1);
  options.shading = {float(dice.between(-.5, .5)), float(dice.between(-.5, .5))};
  options.noise_read = seen.noise * std::sqrt(.5);
  options.noise_shot = seen.noise * seen.noise * .5;
  options.bayer = seen.bayer;
  options.jpeg_quality = seen.jpeg ? 80 + dice.below(18) : 0;
  const Vector3f background = random_color(dice);
  shot.photo = rig::photograph_prints({camera, Pose{}}, prints, background, options, dice.next());
  shot.camera = camera;
  shot.cam_from_target = pose;
  return shot;
}

Verdict judge(const TargetShot& shot, const TargetDesign& design, std::span<const calib::Detection> targets) {
  Verdict verdict;
  for (const calib::Detection& t : targets) {
    bool right = t.id == shot.id && !t.features.empty();
    for (const calib::Feature& f : t.features) {
      const auto at = [&](const Vector2d& p) {
        return shot.camera.project(shot.cam_from_target * Vector3d(p.x(), p.y(), 0));
      };
      const Vector2d place = design.feature(f.index);
      const auto truth = at(place), beside = at(place + Vector2d(.25 * outer_size(design) / 5, 0)),
                 below = at(place + Vector2d(0, .25 * outer_size(design) / 5));
      if (!truth || !beside || !below) continue;
      const double reach = std::max((*beside - *truth).norm(), (*below - *truth).norm());
      right &= (f.pixel - *truth).norm() < std::max(1.5, reach);
    }
    if (right && !verdict.found)
      verdict.found = true;
    else
      ++verdict.wrong;
  }
  return verdict;
}

}  // namespace lumihull::test
