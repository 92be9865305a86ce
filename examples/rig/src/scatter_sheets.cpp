#include <lumihull/base/error.h>
#include <lumihull/rig/target_sheets.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "noise.h"
#include "scattering.h"

namespace lumihull::rig {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
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

  RoomTargets run() {
    walls();
    const double r = scene_.enclosure.radius, near = .26 * r, middle = .6 * r;
    floor(kSmall, clear_of_object(), near);
    floor(kMedium, near, middle);
    floor(kLarge, middle, r);
    out_.set.validate();
    return std::move(out_);
  }

 private:
  double width(Size size) const { return sheet_width(out_.set.designs[size]); }

  double clear_of_object() const {
    double foot = scene_.enclosure.pedestal_radius;
    for (const Object& object : scene_.objects)
      for (const auto& v : object.mesh.vertices) foot = std::max(foot, double(v.head<2>().norm()));
    return foot;
  }

  double random() { return 2 * unit_double(mix(mix(options_.seed, 0x5ee7), draws_++)) - 1; }

  /// A sheet whose middle is at `at`; x, y: the directions of the print before it is turned a little.
  void place(Size size, const Vector3d& at, const Vector3d& x, const Vector3d& y, const char* where) {
    Matrix3d axes;
    axes << x, y, x.cross(y);
    hang(out_, size,
         Pose::from_matrix(axes * Eigen::AngleAxisd(kAskew * random(), Vector3d::UnitZ()).toRotationMatrix(), at),
         where);
  }

  /// Middles of cells of a grid over [0, length], each with what is left to move within it.
  struct Cells {
    int n;
    double step, play;
    Cells(double length, double sheet, double spacing)
        : n(std::max(0, int(length / (spacing * sheet)))), step(n > 0 ? length / n : 0) {
      // A turned square needs cos + sin of its width.
      play = std::max(0., .5 * (step - sheet * (std::cos(kAskew) + std::sin(kAskew))));
    }
  };

  void walls() {
    const Enclosure& room = scene_.enclosure;
    const double half = room.radius * std::tan(kPi / room.panels), w = width(kLarge);
    const Cells across(2 * half, w, options_.spacing), up(room.height, w, options_.spacing);
    for (int panel = 0; panel < room.panels; ++panel) {
      const double angle = 2 * kPi * (panel + .5) / room.panels;
      const Vector3d out(std::cos(angle), std::sin(angle), 0), y(0, 0, -1), x = y.cross(out);
      for (int i = 0; i < across.n; ++i)
        for (int j = 0; j < up.n; ++j) {
          const double u = (i + .5) * across.step - half + across.play * random();
          const double v = (j + .5) * up.step + up.play * random();
          place(kLarge, room.radius * out + u * x + Vector3d(0, 0, v), x, y, "wall");
        }
    }
  }

  /// The ring of the floor between two radii about the axis.
  void floor(Size size, double from, double to) {
    const double w = width(size), reach = w / std::sqrt(2.);  // a sheet's corner from its middle
    const Cells cells(2 * to, w, options_.spacing);
    for (int i = 0; i < cells.n; ++i)
      for (int j = 0; j < cells.n; ++j) {
        const Vector2d at((i + .5) * cells.step - to + cells.play * random(),
                          (j + .5) * cells.step - to + cells.play * random());
        if (at.norm() < from + reach || at.norm() > to - reach) continue;
        // From above the print's z, into the paper, is down.
        const double turn = kPi * random();
        const Vector3d x(std::cos(turn), std::sin(turn), 0), y(std::sin(turn), -std::cos(turn), 0);
        place(size, {at.x(), at.y(), 0}, x, y, "floor");
      }
  }

  const Scene& scene_;
  const TargetSheetOptions& options_;
  RoomTargets out_;
  std::uint64_t draws_ = 0;
};

}  // namespace

double sheet_width(const calib::TargetDesign& design) { return (design.family.grid() + 1) * design.size_m; }

void hang(RoomTargets& targets, int design, const Pose& world_from_target, const char* where) {
  const calib::TargetDesign& as_printed = targets.set.designs[std::size_t(design)];
  const std::span<const int> ids = as_printed.family.ids();
  if (targets.placed.size() >= ids.size())
    throw Error(ErrorCode::invalid_argument, "more sheets than ids: choose a larger spacing or larger circles",
                "targets");
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
  const double reach = sheet_width(targets.set.designs[std::size_t(design)]) / std::sqrt(2.);  // of a corner
  const Vector3d place = at.point.cast<double>();
  Matrix3d axes;
  if (at.surface == Room::kFloor) {
    const double turn = kPi * askew;
    axes << Vector3d(std::cos(turn), std::sin(turn), 0), Vector3d(std::sin(turn), -std::cos(turn), 0),
        -Vector3d::UnitZ();
    if (place.head<2>().norm() < room.pedestal_radius + reach || place.head<2>().norm() > room.radius - reach)
      return std::nullopt;
  } else {
    const Vector3d out = -at.normal.cast<double>(), y(0, 0, -1), x = y.cross(out);
    const double across = x.dot(place), half = room.radius * std::tan(kPi / room.panels);
    if (std::fabs(across) > half - reach || place.z() < reach || place.z() > room.height - reach) return std::nullopt;
    axes << x, y, out;
    axes = axes * Eigen::AngleAxisd(kAskew * askew, Vector3d::UnitZ()).toRotationMatrix();
  }
  for (const PlacedTarget& other : targets.placed) {
    const double apart = reach + sheet_width(targets.set.designs[std::size_t(other.design)]) / std::sqrt(2.);
    if ((other.world_from_target.translation - place).squaredNorm() < apart * apart) return std::nullopt;
  }
  return Pose::from_matrix(axes, place);
}

RoomTargets scatter_targets(const Scene& scene, const Camera& camera, double distance,
                            const TargetSheetOptions& options) {
  if (!(options.circle_px >= 1 && options.circle_px <= 1000) || !(options.spacing >= 1.5 && options.spacing <= 100) ||
      !(std::isfinite(distance) && distance > 0))
    throw Error(ErrorCode::invalid_argument,
                "expected circles of 1 to 1000 px, a spacing of 1.5 to 100 and a positive distance", "targets");
  camera.validate();
  return Scatter(scene, camera, distance, options).run();
}

}  // namespace lumihull::rig
