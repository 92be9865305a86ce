#include <lumihull/base/error.h>
#include <lumihull/rig/target_sheets.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "light/scattering.h"
#include "objects/noise.h"

namespace lumihull::rig {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kAskew = 12 * kPi / 180;  ///< how far sheets are turned by those who put them up

enum Size { kSmall, kMedium, kLarge };

class Scatter {
 public:
  Scatter(const Scene& scene, const Camera& camera, double distance, const TargetSheetOptions& options)
      : scene_(scene), options_(options) {
    const Enclosure& room = scene.enclosure;
    const double foot = scene.center().z();
    // Circles of the wanted size at the distances from which each kind is mostly seen.
    const double far = distance + room.radius, near = distance + foot;
    for (const double from : {near, std::sqrt(near * far), far}) {
      calib::TargetDesign design;
      design.family = calib::TargetFamily::by_name("matrix6x6");
      // To a tenth of a millimetre, as a printer's driver would take it.
      design.size_m = std::round(2 * options.circle_px * from / camera.f * 1e4) * 1e-4;
      // In the enclosure's own hue, so that what keys the enclosure keys the sheets.
      if (scene.enclosure.color.z() > scene.enclosure.color.y())
        for (calib::Rgb* color : {&design.ink, &design.paper}) std::swap((*color)[1], (*color)[2]);
      design.validate();
      out_.set.designs.push_back(design);
    }
  }

  /// Darts that stay where there is room, until the sheets cover their share.
  RoomTargets run() {
    const Enclosure& room = scene_.enclosure;
    const double r = room.radius, near = .26 * r, middle = .6 * r, foot = clear_of_object();
    const double half = r * std::tan(kPi / room.panels);
    const auto wall = [&] {
      const int panel = std::min(room.panels - 1, int(.5 * (random() + 1) * room.panels));
      const double angle = 2 * kPi * (panel + .5) / room.panels, u = half * random();
      const Eigen::Vector3f out(float(std::cos(angle)), float(std::sin(angle)), 0), across(-out.y(), out.x(), 0);
      RoomHit hit;
      hit.surface = Room::kPanels + panel;
      hit.point =
          room.radius * out + float(u) * across + Eigen::Vector3f(0, 0, .5f * (float(random()) + 1) * room.height);
      hit.normal = -out;
      return hit;
    };
    scatter(kLarge, 2 * half * room.panels * room.height, wall);
    const auto ring = [&](double from, double to) {
      return [this, from, to] {
        const double at = std::sqrt(from * from + .5 * (random() + 1) * (to * to - from * from)), turn = kPi * random();
        RoomHit hit;
        hit.surface = Room::kFloor;
        hit.point = {float(at * std::cos(turn)), float(at * std::sin(turn)), 0};
        return hit;
      };
    };
    const auto floor = [&](Size size, double from, double to) {
      if (to > from) scatter(size, kPi * (to * to - from * from), ring(from, to));
    };
    floor(kSmall, foot, near);
    floor(kMedium, std::max(foot, near), middle);
    floor(kLarge, std::max(foot, middle), r);
    if (!out_.placed.empty()) out_.set.validate();
    return std::move(out_);
  }

 private:
  double clear_of_object() const {
    double foot = scene_.enclosure.pedestal_radius;
    for (const Object& object : scene_.objects)
      for (const auto& v : object.mesh.vertices) foot = std::max(foot, double(v.head<2>().norm()));
    return foot;
  }

  double random() { return 2 * unit_double(mix(mix(options_.seed, 0x5ee7), draws_++)) - 1; }

  template <class Dart>
  void scatter(Size size, double area_m2, const Dart& dart) {
    const double w = sheet_width(out_.set.designs[size]);
    const int wanted = int(std::min(1e6, options_.density * area_m2 / (w * w) + .5 * (random() + 1)));
    constexpr int kPatience = 40;  // darts a sheet; beyond that the surface is full
    for (int hung = 0, thrown = 0; hung < wanted && thrown < kPatience * wanted; ++thrown) {
      const RoomHit hit = dart();
      const auto pose = free_place(out_, scene_, size, hit, random());
      if (!pose) continue;
      hang(out_, size, *pose, hit.surface == Room::kFloor ? "floor" : "wall");
      ++hung;
    }
  }

  const Scene& scene_;
  const TargetSheetOptions& options_;
  RoomTargets out_;
  std::uint64_t draws_ = 0;
};

/// Whether two squares in one plane overlap, or leave less than a twentieth of a width between them (separating axes).
bool overlap(const Pose& a, double width_a, const Pose& b, double width_b) {
  const Matrix3d axes_a = a.rotation.toRotationMatrix(), axes_b = b.rotation.toRotationMatrix();
  const Vector3d apart = b.translation - a.translation;
  if (axes_a.col(2).dot(axes_b.col(2)) < .9 || std::fabs(axes_a.col(2).dot(apart)) > .01) return false;
  const double gap = .05 * std::min(width_a, width_b);
  const auto reach = [](const Matrix3d& axes, double width, const Vector3d& along) {
    return .5 * width * (std::fabs(axes.col(0).dot(along)) + std::fabs(axes.col(1).dot(along)));
  };
  for (const Matrix3d* axes : {&axes_a, &axes_b})
    for (int k = 0; k < 2; ++k) {
      const Vector3d along = axes->col(k);
      if (std::fabs(apart.dot(along)) > reach(axes_a, width_a, along) + reach(axes_b, width_b, along) + gap)
        return false;
    }
  return true;
}

}  // namespace

double sheet_width(const calib::TargetDesign& design) { return (design.family.grid() + 1) * design.size_m; }

void hang(RoomTargets& targets, int design, const Pose& world_from_target, const char* where) {
  const calib::TargetDesign& as_printed = targets.set.designs[std::size_t(design)];
  const std::span<const int> ids = as_printed.family.ids();
  if (targets.placed.size() >= ids.size())
    throw Error(ErrorCode::invalid_argument, "more sheets than ids: choose fewer or larger ones", "targets");
  const int id = ids[targets.placed.size()];
  FlatPrint print = print_of(as_printed, id);
  print.world_from_print = world_from_target;
  targets.prints.push_back(std::move(print));
  targets.placed.push_back({design, id, world_from_target});
  char name[32];
  std::snprintf(name, sizeof name, "%s-%04d", where, id);
  targets.set.boards.push_back({name, {{design, id, Pose{}}}});
}

std::optional<Pose> free_place(const RoomTargets& targets, const Scene& scene, int design, const RoomHit& at,
                               double askew) {
  const Enclosure& room = scene.enclosure;
  const double width = sheet_width(targets.set.designs[std::size_t(design)]);
  const Vector3d place = at.point.cast<double>();
  Matrix3d axes;
  if (at.surface == Room::kFloor) {
    const double turn = kPi * askew, reach = width / std::sqrt(2.);  // of a corner
    axes << Vector3d(std::cos(turn), std::sin(turn), 0), Vector3d(std::sin(turn), -std::cos(turn), 0),
        -Vector3d::UnitZ();
    if (place.head<2>().norm() < room.pedestal_radius + reach || place.head<2>().norm() > room.radius - reach)
      return std::nullopt;
  } else {
    const double turn = kAskew * askew, reach = .5 * width * (std::cos(turn) + std::fabs(std::sin(turn)));
    const Vector3d out = -at.normal.cast<double>(), y(0, 0, -1), x = y.cross(out);
    const double across = x.dot(place), half = room.radius * std::tan(kPi / room.panels);
    if (std::fabs(across) > half - reach || place.z() < reach || place.z() > room.height - reach) return std::nullopt;
    axes << x, y, out;
    axes = axes * Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
  }
  const Pose pose = Pose::from_matrix(axes, place);
  for (const PlacedTarget& other : targets.placed)
    if (overlap(pose, width, other.world_from_target, sheet_width(targets.set.designs[std::size_t(other.design)])))
      return std::nullopt;
  return pose;
}

void expect_hung(const RoomTargets& targets, double circle_px) {
  if (!targets.placed.empty()) return;
  double least_m = 1e300;
  for (const calib::TargetDesign& design : targets.set.designs) least_m = std::min(least_m, sheet_width(design));
  char text[300];
  std::snprintf(
      text, sizeof text,
      "no sheet of targets hangs in the room: the smallest is %.2g m wide, so that circles of %g px are seen; "
      "smaller circles (--target-px), wider photographs (--width) or a larger share of the walls are needed",
      least_m, circle_px);
  throw Error(ErrorCode::invalid_argument, text, "sheets");
}

RoomTargets scatter_targets(const Scene& scene, const Camera& camera, double distance,
                            const TargetSheetOptions& options) {
  if (!(options.circle_px >= 1 && options.circle_px <= 1000) || !(options.density > 0 && options.density <= .4) ||
      !(std::isfinite(distance) && distance > 0))
    throw Error(ErrorCode::invalid_argument,
                "expected circles of 1 to 1000 px, a density of at most 0.4 and a positive distance", "targets");
  camera.validate();
  return Scatter(scene, camera, distance, options).run();
}

}  // namespace lumihull::rig
