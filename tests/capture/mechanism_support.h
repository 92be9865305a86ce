#pragma once

// Mechanisms and poses for tests.

#include <lumihull/capture/mechanism.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>

namespace lumihull::test {

inline Pose pose_on_hemisphere(double theta, double phi, double radius = 1.5) {
  // Paper, eq. 6, without torsion.
  const double tilt = 2.0 / 3 * phi - std::numbers::pi / 6;
  const Eigen::AngleAxisd to(theta, Eigen::Vector3d::UnitZ()), back(-theta, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd tilted(tilt, Eigen::Vector3d::UnitY());
  return {Eigen::Quaterniond(to * tilted * back),
          radius * Eigen::Vector3d(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), std::cos(phi))};
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }
  Eigen::Vector3d vector(double size) {
    const double x = uniform(-size, size), y = uniform(-size, size);
    return {x, y, uniform(-size, size)};
  }
  Eigen::Vector3d direction() {
    const double x = normal(), y = normal();
    return Eigen::Vector3d(x, y, normal()).normalized();
  }
  Eigen::Quaterniond rotation(double largest_angle) {
    const double angle = uniform(0, largest_angle);
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, direction()));
  }

 private:
  std::mt19937_64 engine_;
};

/// Cables from anywhere on the upper half of the walls to anywhere on the end-effector.
inline capture::Mechanism random_mechanism(Random& random, int cables) {
  capture::Mechanism mechanism = capture::paper_mechanism();
  mechanism.cables.clear();
  for (int i = 0; i < cables; ++i) {
    capture::Cable cable;
    cable.name = std::to_string(i);
    cable.departure = {random.uniform(-5, 5), random.uniform(-6, 6), random.uniform(2, 5)};
    const int wall = random.integer(0, 3);
    if (wall < 2)
      cable.departure.x() = wall == 0 ? -5 : 5;
    else
      cable.departure.y() = wall == 2 ? -6 : 6;
    cable.attachment = {random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25), random.uniform(-0.1, 0.1)};
    mechanism.cables.push_back(cable);
  }
  mechanism.center_of_mass = random.vector(0.05);
  return mechanism;
}

}  // namespace lumihull::test
