// Least distances at one pose.
#include <lumihull/base/error.h>
#include <lumihull/capture/clearance.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry.h"
#include "segments.h"

namespace lumihull::capture {
namespace {

using internal::Segment;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kAroundSharedPoint_m = 0.05;

/// Signed distance of a point from the object's solid, a convex set: a convex function.
double object_distance(const KeepOut& object, const Eigen::Vector3d& point) {
  const Eigen::Vector3d d = point - object.base;
  const double out = d.head<2>().norm(), above = d.z() - object.height_m;
  const double side = above > 0 ? std::hypot(out, above) - object.radius_m : out - object.radius_m;
  if (d.z() >= 0) return side > 0 ? side : std::max(side, -d.z());
  return out > object.radius_m ? std::hypot(out - object.radius_m, d.z()) : -d.z();
}

/// The least of a convex function along a segment, by golden sections.
double object_distance(const KeepOut& object, const Segment& segment) {
  const auto at = [&](double s) {
    return object_distance(object, Eigen::Vector3d(segment.from + s * (segment.to - segment.from)));
  };
  constexpr double kGolden = 0.6180339887498949;
  double low = 0, high = 1, s = 1 - kGolden, t = kGolden;
  double at_s = at(s), at_t = at(t), least = std::min({at(0), at(1), at_s, at_t});
  const double length = (segment.to - segment.from).norm();
  while ((high - low) * length > 1e-9 && high - low > 1e-12) {
    if (at_s < at_t) {
      high = t, t = s, at_t = at_s;
      s = high - kGolden * (high - low), at_s = at(s);
    } else {
      low = s, s = t, at_s = at_t;
      t = low + kGolden * (high - low), at_t = at(t);
    }
    least = std::min({least, at_s, at_t});
  }
  return least;
}

/// Without the first `cut` metres at one end; what remains may be nothing.
bool shorten(Segment* segment, bool at_departure, double cut) {
  const Eigen::Vector3d d = segment->to - segment->from;
  const double length = d.norm();
  if (!(length > cut)) return false;
  if (at_departure)
    segment->to -= d * (cut / length);
  else
    segment->from += d * (cut / length);
  return true;
}

}  // namespace

Clearance clearance(const Mechanism& mechanism, const Pose& world_from_platform, const KeepOut* object) {
  internal::need_usable(mechanism, world_from_platform);
  if (object && (!(object->radius_m >= 0) || !(object->height_m >= 0) || !std::isfinite(object->radius_m) ||
                 !std::isfinite(object->height_m) || !object->base.allFinite()))
    throw Error(ErrorCode::invalid_argument, "expected a finite keep-out volume with sizes of at least 0", "object");
  const std::size_t n = mechanism.cables.size();
  const Eigen::Vector3d center = world_from_platform.translation;
  std::array<Segment, 12> segments;
  for (std::size_t i = 0; i < n; ++i)
    segments[i] = {world_from_platform * mechanism.cables[i].attachment, mechanism.cables[i].departure};

  Clearance result;
  result.cable_cable = result.cable_platform = result.cable_camera = result.cable_object = result.platform_object =
      kInfinite;
  const double radius = mechanism.cable_radius_m;
  for (std::size_t i = 0; i < n; ++i) {
    const double to_center = internal::distance(segments[i], center);
    result.cable_camera = std::min(result.cable_camera, to_center - radius);
    if (mechanism.cables[i].attachment.norm() > mechanism.platform_radius_m)
      result.cable_platform = std::min(result.cable_platform, to_center - mechanism.platform_radius_m - radius);
    if (object) result.cable_object = std::min(result.cable_object, object_distance(*object, segments[i]) - radius);
    for (std::size_t k = i + 1; k < n; ++k) {
      Segment a = segments[i], b = segments[k];
      bool remains = true;
      if (internal::same_point(mechanism.cables[i].attachment, mechanism.cables[k].attachment))
        remains = shorten(&a, false, kAroundSharedPoint_m) && shorten(&b, false, kAroundSharedPoint_m);
      if (internal::same_point(mechanism.cables[i].departure, mechanism.cables[k].departure))
        remains = remains && shorten(&a, true, kAroundSharedPoint_m) && shorten(&b, true, kAroundSharedPoint_m);
      if (remains) result.cable_cable = std::min(result.cable_cable, internal::distance(a, b) - 2 * radius);
    }
  }
  const double sphere = mechanism.platform_radius_m;
  if (object) result.platform_object = object_distance(*object, center) - sphere;
  result.platform_room =
      std::min((center - mechanism.room.min()).minCoeff(), (mechanism.room.max() - center).minCoeff()) - sphere;
  return result;
}

}  // namespace lumihull::capture
