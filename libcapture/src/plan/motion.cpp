// Moves limited in jerk, the same for all cables.
#include <lumihull/base/error.h>
#include <lumihull/capture/motion.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;

constexpr int kSamples = 64;
constexpr double kReserve = 1.01;

/// Rotation vector of the shortest rotation in world axes.
Vector3d rotation_between(const Pose& from, const Pose& to) {
  Eigen::Quaterniond q = to.rotation * from.rotation.conjugate();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  // The angle from both parts of the quaternion: an arc cosine loses small angles.
  return sine > 1e-12 ? Vector3d(q.vec() / sine * (2 * std::atan2(sine, q.w()))) : Vector3d(2 * q.vec());
}

}  // namespace

std::array<double, 3> MotionProfile::at(double t) const {
  const double total = duration_s();
  if (t <= 0 || total <= 0) return {0, 0, 0};
  if (t >= total) return {distance, 0, 0};
  // The second half mirrors the first one.
  if (t > 0.5 * total) {
    const auto [s, v, a] = at(total - t);
    return {distance - s, v, -a};
  }
  double s = 0, v = 0, a = 0;
  const std::array<std::array<double, 2>, 4> pieces = {{{jerk_s, jerk}, {ramp_s, 0}, {jerk_s, -jerk}, {cruise_s, 0}}};
  for (const auto& [length, j] : pieces) {
    const double dt = std::min(t, length);
    s += dt * (v + dt * (0.5 * a + dt * j / 6));
    v += dt * (a + 0.5 * dt * j);
    a += dt * j;
    t -= dt;
    if (t <= 0) break;
  }
  return {s, v, a};
}

MotionProfile MotionProfile::slower(double factor) const {
  return {distance, jerk / (factor * factor * factor), jerk_s * factor, ramp_s * factor, cruise_s * factor};
}

MotionProfile rest_to_rest(double distance, double speed, double acceleration, double jerk) {
  if (!(distance >= 0) || !std::isfinite(distance) || !(speed > 0) || !(acceleration > 0) || !(jerk > 0))
    throw Error(ErrorCode::invalid_argument, "expected a distance of at least 0 and positive limits", "motion");
  MotionProfile p{distance, jerk, 0, 0, 0};
  if (distance == 0) return p;
  const double a = acceleration, j = jerk;
  // The speed that is reached, at most the limit: v (v/a + a/j) = distance where the acceleration's limit is reached,
  // else 2 v sqrt(v/j) = distance.
  double v = 0.5 * (std::sqrt(a * a / j * (a * a / j) + 4 * a * distance) - a * a / j);
  if (v < a * a / j) v = std::cbrt(0.25 * distance * distance * j);
  v = std::min(v, speed);
  if (v < a * a / j) {
    p.jerk_s = std::sqrt(v / j);
  } else {
    p.jerk_s = a / j;
    p.ramp_s = v / a - a / j;
  }
  p.cruise_s = std::max(0.0, distance / v - (2 * p.jerk_s + p.ramp_s));
  return p;
}

double motion_distance(const Mechanism& mechanism, const Pose& from, const Pose& to) {
  return (to.translation - from.translation).norm() + mechanism.platform_radius_m * rotation_between(from, to).norm();
}

Pose between(const Pose& from, const Pose& to, double share) {
  if (share <= 0) return from;
  if (share >= 1) return to;
  return {from.rotation.slerp(share, to.rotation), from.translation + share * (to.translation - from.translation)};
}

double least_duration_s(const Mechanism& mechanism, const Pose& from, const Pose& to) {
  const MotionLimits& l = mechanism.limits;
  return rest_to_rest(motion_distance(mechanism, from, to), l.speed_m_s, l.acceleration_m_s2, l.jerk_m_s3).duration_s();
}

Move plan_move(const Mechanism& mechanism, const Pose& from, const Pose& to) {
  const MotionLimits& l = mechanism.limits;
  const double distance = motion_distance(mechanism, from, to);
  Move move{from, to, rest_to_rest(distance, l.speed_m_s, l.acceleration_m_s2, l.jerk_m_s3), 0, 0};
  if (distance == 0) return move;
  Eigen::Matrix<double, 6, 1> twist;  // by the share of the way
  twist << to.translation - from.translation, rotation_between(from, to);
  const auto rate = [&](double share) -> CableVector {
    return -wrench_matrix(mechanism, between(from, to, share)).transpose() * twist;
  };
  const double duration = move.duration_s();
  for (int i = 0; i <= kSamples; ++i) {
    const auto [s, v, a] = move.profile.at(duration * i / kSamples);
    const double share = std::clamp(s / distance, 0.0, 1.0), step = 1e-4;
    const double low = std::max(0.0, share - step), high = std::min(1.0, share + step);
    const CableVector first = rate(share), second = (rate(high) - rate(low)) / (high - low);
    const double ds = v / distance, dds = a / distance;
    move.cable_speed_m_s = std::max(move.cable_speed_m_s, (first * ds).cwiseAbs().maxCoeff());
    move.cable_acceleration_m_s2 =
        std::max(move.cable_acceleration_m_s2, (second * ds * ds + first * dds).cwiseAbs().maxCoeff());
  }
  // Slower by k: speeds by k, accelerations by k².
  const double slower = std::max({1.0, kReserve * move.cable_speed_m_s / l.cable_speed_m_s,
                                  std::sqrt(kReserve * move.cable_acceleration_m_s2 / l.cable_acceleration_m_s2)});
  if (slower > 1) {
    move.profile = move.profile.slower(slower);
    move.cable_speed_m_s /= slower;
    move.cable_acceleration_m_s2 /= slower * slower;
  }
  return move;
}

Pose pose_at(const Move& move, double t_s) {
  const double distance = move.profile.distance;
  if (distance == 0) return move.to;
  return between(move.from, move.to, t_s >= move.duration_s() ? 1 : move.profile.at(t_s)[0] / distance);
}

std::vector<Setpoint> setpoints(const Mechanism& mechanism, const Move& move, double period_s) {
  constexpr double kMostSetpoints = 1e6;
  const double duration = move.duration_s();
  if (!(period_s > 0) || duration / period_s > kMostSetpoints)
    throw Error(ErrorCode::invalid_argument, "expected a positive period, and at most 1000000 of them in a move",
                "setpoints");
  std::vector<Setpoint> points;
  const auto add = [&](double t, const Pose& pose) {
    const CableVector lengths = cable_lengths(mechanism, pose);
    points.push_back({t, {lengths.data(), lengths.data() + lengths.size()}});
  };
  const std::size_t n = std::size_t(std::ceil(duration / period_s - 1e-9));
  for (std::size_t i = 0; i < n; ++i) add(double(i) * period_s, pose_at(move, double(i) * period_s));
  add(duration, move.to);
  return points;
}

}  // namespace lumihull::capture
