#include <lumihull/base/error.h>
#include <lumihull/rig/trajectory.h>

#include <algorithm>
#include <cmath>

#include "objects/noise.h"

namespace lumihull::rig {

using Eigen::Vector3d;

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Uniform in [-1, 1), the same for a (seed, shot, channel).
double random(const Hemisphere& h, int shot, int channel) {
  return 2 * unit_double(mix(mix(h.seed, 0x7a11), std::uint64_t(shot) * 16 + std::uint64_t(channel))) - 1;
}

Pose shot_at(const Hemisphere& h, int shot, double phi, double theta) {
  const Vector3d out(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), std::cos(phi));
  // Towards the pole: the picture's upper side, defined from straight above, too.
  const Vector3d up(-std::cos(phi) * std::cos(theta), -std::cos(phi) * std::sin(theta), std::sin(phi));
  const double wobble = h.jitter * h.radius;
  const Vector3d eye =
      h.target + h.radius * out + wobble * Vector3d(random(h, shot, 0), random(h, shot, 1), random(h, shot, 2));
  const Vector3d aim = h.target + wobble * Vector3d(random(h, shot, 3), random(h, shot, 4), random(h, shot, 5));
  return look_at(eye, aim, up);
}

void check(int n, const Hemisphere& h) {
  if (n < 1 || n > 1'000'000 || !(h.radius > 0) || !(h.jitter >= 0 && h.jitter < .5) || !(h.phi_first >= 0) ||
      !(h.phi_last >= h.phi_first) || !(h.phi_last <= kPi))
    throw Error(ErrorCode::invalid_argument,
                "expected at least one shot, a positive radius and 0 <= phi_first <= phi_last <= pi", "trajectory");
}

}  // namespace

Camera sensor_camera(int width, double focal_mm, double sensor_width_mm, double distortion) {
  if (width < 2 || !(focal_mm > 0) || !(sensor_width_mm > 0) || !std::isfinite(focal_mm) ||
      !std::isfinite(sensor_width_mm) || !(distortion >= 0 && distortion <= 1))
    throw Error(ErrorCode::invalid_argument,
                "expected a width of at least 2 px, positive lengths, and distortion from 0 to 1", "sensor camera");
  Camera camera;
  camera.width = width;
  camera.height = width * 2 / 3;
  camera.f = focal_mm / sensor_width_mm * width;
  camera.s = 1 + .0004 * distortion;
  camera.u0 = .5 * camera.width + .0041 * width * distortion;
  camera.v0 = .5 * camera.height - .0027 * width * distortion;
  camera.k1 = .034 * distortion, camera.k2 = -.011 * distortion, camera.k3 = .002 * distortion;
  camera.p1 = .0004 * distortion, camera.p2 = -.0003 * distortion;
  return camera;
}

Camera default_camera(int width, bool distortion) {
  return sensor_camera(width, kFocalLength_mm, kSensorWidth_mm, distortion ? 1 : 0);
}

double framing_distance(const Camera& camera, double ball_radius, double fill) {
  const double half = std::atan(.5 * std::min(camera.width / camera.s, double(camera.height)) / camera.f);
  return ball_radius / std::sin(std::atan(fill * std::tan(half)));
}

std::vector<Pose> hemisphere_trajectory(int n, const Hemisphere& h) {
  check(n, h);
  // Steps in phi: about sqrt(n / 3) so that steps in phi and theta are alike in the middle; a divisor of n, if one is
  // near.
  const double ideal = std::max(1.0, std::sqrt(n / 3.0));
  int rows = std::max(1, int(std::lround(ideal)));
  for (int k = std::max(1, int(ideal * .7)); k <= int(std::ceil(ideal * 1.4)); ++k)
    if (n % k == 0 && (n % rows != 0 || std::fabs(k - ideal) < std::fabs(rows - ideal))) rows = k;
  const int columns = (n + rows - 1) / rows;
  std::vector<Pose> poses;
  for (int i = 0; i < n; ++i) {
    const double t = rows > 1 ? double(i % rows) / (rows - 1) : 1;
    poses.push_back(shot_at(h, i, h.phi_first + t * (h.phi_last - h.phi_first), 2 * kPi * (i / rows) / columns));
  }
  return poses;
}

std::vector<Pose> ring_trajectory(int n, const Hemisphere& h) {
  check(n, h);
  std::vector<Pose> poses;
  for (int i = 0; i < n; ++i) poses.push_back(shot_at(h, i, h.phi_last, 2 * kPi * i / n));
  return poses;
}

std::vector<Pose> random_trajectory(int n, const Hemisphere& h) {
  check(n, h);
  std::vector<Pose> poses;
  for (int i = 0; i < n; ++i) {
    const double a = std::cos(h.phi_first), b = std::cos(h.phi_last);
    const double phi = std::acos(std::clamp(a + (b - a) * .5 * (random(h, i, 6) + 1), -1.0, 1.0));
    const Pose roll{Eigen::Quaterniond(Eigen::AngleAxisd(kPi * random(h, i, 8), Vector3d::UnitZ())), Vector3d::Zero()};
    poses.push_back(roll * shot_at(h, i, phi, kPi * random(h, i, 7)));
  }
  return poses;
}

std::vector<Pose> arc_trajectory(int n, const Hemisphere& h, double theta_middle) {
  check(n, h);
  std::vector<Pose> poses;
  for (int i = 0; i < n; ++i) {
    const double t = n > 1 ? double(i) / (n - 1) : .5;
    const double phi = (h.phi_first + h.phi_last) / 2 + (h.phi_last - h.phi_first) / 4 * std::sin(2 * kPi * t);
    poses.push_back(shot_at(h, i, phi, theta_middle + 2 * kPi / 3 * (t - .5)));
  }
  return poses;
}

}  // namespace lumihull::rig
