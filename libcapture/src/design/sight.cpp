#include "sight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::capture::design {

double sight_rad(const Mechanism& mechanism, const Pose& world_from_platform, double bearing_rad,
                 const Eigen::Vector3d& center, double ball_radius_m) {
  const Eigen::Vector3d eye = world_from_platform * cam_from_platform(mechanism, bearing_rad).center();
  const Eigen::Vector3d line = center - eye;
  const double distance = line.norm();
  if (!(distance > ball_radius_m)) return -std::numbers::pi / 2;
  const Eigen::Vector3d d = line / distance;
  double largest_cosine = -1;
  for (const Cable& cable : mechanism.cables) {
    const Eigen::Vector3d b = world_from_platform * cable.attachment - eye, v = cable.departure - eye - b;
    const auto look = [&](double s) {
      const Eigen::Vector3d x = b + s * v;
      const double length = x.norm();
      largest_cosine = std::max(largest_cosine, length > 0 ? d.dot(x) / length : 1);
    };
    look(0), look(1);
    // d·x / |x| is stationary where (d·v)|x|² = (d·x)(x·v), which is linear in s.
    const double slope = d.dot(v) * b.dot(v) - d.dot(b) * v.squaredNorm(),
                 constant = d.dot(v) * b.squaredNorm() - d.dot(b) * b.dot(v), s = -constant / slope;
    if (s > 0 && s < 1) look(s);
  }
  return std::acos(std::clamp(largest_cosine, -1.0, 1.0)) - std::asin(ball_radius_m / distance);
}

}  // namespace lumihull::capture::design
