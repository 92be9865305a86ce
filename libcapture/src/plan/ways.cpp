#include "ways.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lumihull::capture::internal {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kStep_m = 0.05, kStep_rad = kPi / 60;  // of the checks along a line

Vector3d direction(double theta, double phi) {
  return {std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), std::cos(phi)};
}

}  // namespace

bool WayFinder::clear(const Pose& from, const Pose& to, std::string* why) const {
  if (const auto crossing = first_crossing(mechanism_, from, to)) {
    if (why)
      *why = "cables " + mechanism_.cables[std::size_t(crossing->first)].name + " and " +
             mechanism_.cables[std::size_t(crossing->second)].name + " would cross";
    return false;
  }
  const double straight = (to.translation - from.translation).norm();
  const double turn = from.rotation.angularDistance(to.rotation);
  const int steps = int(std::ceil(std::max({1.0, straight / kStep_m, turn / kStep_rad})));
  for (int i = 1; i < steps; ++i) {
    const PoseJudgement judged = judge_pose(mechanism_, between(from, to, double(i) / steps), object_, limits_);
    if (judged.ok()) continue;
    if (why) *why = judged.obstacles.front().text;
    return false;
  }
  return true;
}

bool WayFinder::follow(const std::vector<Pose>& via, const Pose& from, const Pose& to, Way& best) const {
  Way way;
  const Pose* last = &from;
  for (std::size_t i = 0; i <= via.size(); ++i) {
    const Pose& next = i < via.size() ? via[i] : to;
    if (i < via.size() && !judge_pose(mechanism_, next, object_, limits_).ok()) return false;
    way.length_m += (next.translation - last->translation).norm();
    way.duration_s += plan_move(mechanism_, *last, next).duration_s();
    if (best.open && way.duration_s >= best.duration_s) return false;
    last = &next;
  }
  last = &from;
  for (std::size_t i = 0; i <= via.size(); ++i) {
    const Pose& next = i < via.size() ? via[i] : to;
    if (!clear(*last, next, nullptr)) return false;
    last = &next;
  }
  way.open = true;
  way.via = via;
  best = std::move(way);
  return true;
}

Way WayFinder::find(const Pose& from, const Pose& to) const {
  Way way;
  if (clear(from, to, &way.why)) {
    way.open = true;
    way.length_m = (to.translation - from.translation).norm();
    way.duration_s = plan_move(mechanism_, from, to).duration_s();
    return way;
  }
  // Round it: along the great circle, or by way of a higher place between both azimuths, at the stops' radius and
  // farther out; in one, two or more straight lines. The shortest of those that are open is taken.
  const Vector3d a = from.translation - center_, b = to.translation - center_;
  const double radius = std::max(a.norm(), b.norm());
  if (!(radius > 0) || !(a.norm() > 0) || !(b.norm() > 0)) return way;
  const double arc = std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0));
  const double theta_a = std::atan2(a.y(), a.x()), theta_b = std::atan2(b.y(), b.x());
  const double turn = std::remainder(theta_b - theta_a, 2 * kPi);
  const double phi_a = std::acos(std::clamp(a.z() / a.norm(), -1.0, 1.0));
  const double phi_b = std::acos(std::clamp(b.z() / b.norm(), -1.0, 1.0));
  const auto place = [&](const Vector3d& out, double out_by, double share) -> Pose {
    return {from.rotation.slerp(share, to.rotation), center_ + radius * out_by * out.normalized()};
  };
  for (const double out_by : {1.0, 1.1, 1.25}) {
    if (arc > 1e-6 && arc < kPi - 1e-3)
      for (const int pieces : {2, 3, 4}) {
        std::vector<Pose> via;
        for (int i = 1; i < pieces; ++i) {
          const double t = double(i) / pieces;
          const Vector3d out =
              (std::sin((1 - t) * arc) * a.normalized() + std::sin(t * arc) * b.normalized()) / std::sin(arc);
          via.push_back(place(out, out_by, t));
        }
        follow(via, from, to, way);
      }
    for (const double height : {0.75, 0.5, 0.25, 0.0}) {
      const double phi = height * std::min(phi_a, phi_b);
      follow({place(direction(theta_a + 0.5 * turn, phi), out_by, 0.5)}, from, to, way);
      follow({place(direction(theta_a, phi), out_by, 0.25), place(direction(theta_b, phi), out_by, 0.75)}, from, to,
             way);
    }
    // Round the side, both ways.
    for (const double sweep : {turn, turn > 0 ? turn - 2 * kPi : turn + 2 * kPi}) {
      const int pieces = std::max(2, int(std::ceil(std::abs(sweep) / (kPi / 4))));
      std::vector<Pose> via;
      for (int i = 1; i < pieces; ++i) {
        const double t = double(i) / pieces;
        via.push_back(place(direction(theta_a + t * sweep, phi_a + t * (phi_b - phi_a)), out_by, t));
      }
      follow(via, from, to, way);
    }
    if (way.open) break;
  }
  if (way.open) way.why.clear();
  return way;
}

}  // namespace lumihull::capture::internal
