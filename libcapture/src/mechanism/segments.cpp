#include "segments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lumihull::capture::internal {
namespace {

/// Parameter of the point of a segment that is nearest to a point.
double nearest(const Segment& segment, const Eigen::Vector3d& point) {
  const Eigen::Vector3d d = segment.to - segment.from;
  const double l2 = d.squaredNorm();
  return l2 > 0 ? std::clamp((point - segment.from).dot(d) / l2, 0.0, 1.0) : 0;
}

double squared(const Segment& segment, const Eigen::Vector3d& point) {
  const double s = nearest(segment, point);
  return (segment.from + s * (segment.to - segment.from) - point).squaredNorm();
}

}  // namespace

double distance(const Segment& segment, const Eigen::Vector3d& point) { return std::sqrt(squared(segment, point)); }

double distance(const Segment& a, const Segment& b) {
  // Either an end of one is nearest, or the common perpendicular's feet are within both.
  double least = std::min({squared(a, b.from), squared(a, b.to), squared(b, a.from), squared(b, a.to)});
  const Eigen::Vector3d u = a.to - a.from, v = b.to - b.from, w = b.from - a.from;
  const Eigen::Vector3d n = u.cross(v);
  const double n2 = n.squaredNorm();
  if (n2 > 0) {
    const double s = w.cross(v).dot(n), t = w.cross(u).dot(n);
    if (s >= 0 && s <= n2 && t >= 0 && t <= n2) {
      const double along = w.dot(n);
      least = std::min(least, along * along / n2);
    }
  }
  return std::sqrt(least);
}

}  // namespace lumihull::capture::internal
