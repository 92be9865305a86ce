// Targets on the walls: a list of them, or a guess before they are hung; which of them a view shows.
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/trajectory.h>
#include <lumihull/internal/pose_json.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;
using lumihull::internal::Json;
using lumihull::internal::JsonReader;

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMaxTargets = 100'000;
constexpr std::size_t kMaxBytes = std::size_t(256) << 20;

Vector3d read_point(const JsonReader& json) {
  if (json.array_size(3) != 3) json.fail("three numbers");
  return {json.at(0).number(-1e6, 1e6), json.at(1).number(-1e6, 1e6), json.at(2).number(-1e6, 1e6)};
}

PlacedTarget read_target(const JsonReader& json) {
  PlacedTarget target{read_point(json.at("center")), read_point(json.at("normal")),
                      json.at("size_m").number(1e-4, 100)};
  const double length = target.normal.norm();
  if (!(length > 1e-9)) json.at("normal").fail("a direction, not zero");
  target.normal /= length;
  return target;
}

/// A solved body of targets.json as one target: its points' middle and extent; z of a target's frame points into the
/// paper.
std::optional<PlacedTarget> read_body(const JsonReader& json) {
  if (!json.at("placed").boolean()) return {};
  const Pose pose = lumihull::internal::read_pose(json.at("world_from_body"));
  const JsonReader points = json.at("points");
  const std::size_t n = points.array_size(kMaxTargets);
  PlacedTarget target;
  target.center.setZero();
  target.normal = pose.rotation * -Vector3d::UnitZ();
  Eigen::AlignedBox3d box;
  std::size_t placed = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!points.at(i).has("point")) continue;
    const Vector3d p = read_point(points.at(i).at("point"));
    target.center += p;
    box.extend(pose.rotation.conjugate() * p);
    ++placed;
  }
  if (placed == 0) return {};
  target.center /= double(placed);
  target.size_m = std::max(1e-4, box.sizes().maxCoeff());
  return target;
}

/// Does the object lie between the eye and a point?
bool hidden(const ObjectSize& object, const Vector3d& center, const Vector3d& eye, const Vector3d& point) {
  const Vector3d a = eye - center, d = point - eye;
  const double r = 0.5 * object.diameter_m;
  if (object.height_m <= 0) {
    const double t = std::clamp(-a.dot(d) / d.squaredNorm(), 0.0, 1.0);
    return (a + t * d).norm() < r;
  }
  // The part of the segment within the cylinder's heights, then its nearest approach to the axis.
  double t0 = 0, t1 = 1;
  const double h = 0.5 * object.height_m;
  if (std::abs(d.z()) < 1e-12) {
    if (std::abs(a.z()) >= h) return false;
  } else {
    const double u = (-h - a.z()) / d.z(), v = (h - a.z()) / d.z();
    t0 = std::max(t0, std::min(u, v)), t1 = std::min(t1, std::max(u, v));
    if (t0 >= t1) return false;
  }
  const double across = d.head<2>().squaredNorm();
  const double t = across > 1e-18 ? std::clamp(-a.head<2>().dot(d.head<2>()) / across, t0, t1) : t0;
  return (a + t * d).head<2>().norm() < r;
}

/// Uniform in [0, 1); std's distributions differ between libraries.
double unit(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

}  // namespace

std::vector<PlacedTarget> scatter_targets(const Enclosure& e) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0 && x < 1e4; };
  if (!positive(e.radius_m) || !positive(e.top_m - e.floor_m) || !positive(e.target_size_m) || e.panels < 3 ||
      e.panels > 1000 || e.targets < 0 || std::size_t(e.targets) > kMaxTargets)
    throw Error(ErrorCode::invalid_argument,
                "expected a positive radius, height and size of targets, 3 to 1000 panels, at most 100000 targets",
                "enclosure");
  std::mt19937_64 random(e.seed);
  const double half = e.radius_m * std::tan(kPi / e.panels);  // of a panel's width
  const double walls = 2 * half * e.panels * (e.top_m - e.floor_m), floor = half * e.radius_m * e.panels;
  std::vector<PlacedTarget> targets;
  for (int i = 0; i < e.targets; ++i) {
    PlacedTarget target;
    target.size_m = e.target_size_m;
    const double which = unit(random) * (walls + floor), u = unit(random), v = unit(random);
    const int panel = std::min(e.panels - 1, int(unit(random) * e.panels));
    const double angle = 2 * kPi * panel / e.panels;
    const Vector3d out(std::cos(angle), std::sin(angle), 0), along(-out.y(), out.x(), 0);
    if (which < walls) {
      target.center =
          e.radius_m * out + (2 * u - 1) * half * along + Vector3d(0, 0, e.floor_m + v * (e.top_m - e.floor_m));
      target.normal = -out;
    } else {  // a triangle from the middle to the panel
      const double depth = std::sqrt(v);
      target.center = depth * (e.radius_m * out + (2 * u - 1) * half * along) + Vector3d(0, 0, e.floor_m);
      target.normal = Vector3d::UnitZ();
    }
    target.center += e.center;
    targets.push_back(target);
  }
  return targets;
}

std::vector<PlacedTarget> read_placed_targets(const std::filesystem::path& file) {
  const Json json = lumihull::internal::read_json(file, kMaxBytes);
  const JsonReader top(json, file.string());
  std::vector<PlacedTarget> targets;
  if (top.at("format").string() == "lumihull-target-model") {
    const JsonReader bodies = top.at("bodies");
    const std::size_t n = bodies.array_size(kMaxTargets);
    for (std::size_t i = 0; i < n; ++i)
      if (const auto target = read_body(bodies.at(i))) targets.push_back(*target);
    return targets;
  }
  lumihull::internal::check_format(top, "lumihull-placed-targets", 1);
  const JsonReader list = top.at("targets");
  const std::size_t n = list.array_size(kMaxTargets);
  for (std::size_t i = 0; i < n; ++i) targets.push_back(read_target(list.at(i)));
  return targets;
}

int targets_in_view(const View& view, std::span<const PlacedTarget> targets, const ObjectSize& object,
                    const Vector3d& center, const TargetSight& sight) {
  const Vector3d eye = view.center();
  const double least_cosine = std::cos(sight.largest_tilt_rad);
  int seen = 0;
  for (const PlacedTarget& target : targets) {
    const Vector3d to_eye = eye - target.center;
    if (to_eye.normalized().dot(target.normal) < least_cosine) continue;
    const Vector3d any = std::abs(target.normal.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    const Vector3d u = target.normal.cross(any).normalized(), v = target.normal.cross(u);
    Eigen::Matrix<double, 2, 4> corners;
    bool inside = true;
    for (int k = 0; k < 4 && inside; ++k) {
      const double x = (k == 0 || k == 3 ? -0.5 : 0.5) * target.size_m, y = (k < 2 ? -0.5 : 0.5) * target.size_m;
      const auto px = view.project(target.center + x * u + y * v);
      inside = px && view.camera.contains(*px);
      if (inside) corners.col(k) = *px;
    }
    if (!inside) continue;
    // As small as it looks in its narrower direction.
    const double width = 0.5 * ((corners.col(1) - corners.col(0)).norm() + (corners.col(2) - corners.col(3)).norm());
    const double height = 0.5 * ((corners.col(3) - corners.col(0)).norm() + (corners.col(2) - corners.col(1)).norm());
    if (std::min(width, height) < sight.least_size_px) continue;
    if (!hidden(object, center, eye, target.center)) ++seen;
  }
  return seen;
}

}  // namespace lumihull::capture
