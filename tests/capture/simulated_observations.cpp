#include "simulated_observations.h"

#include <lumihull/capture/workspace.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace lumihull::test {
namespace {

using Eigen::Vector3d;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double within(double low, double high) { return low + (high - low) * double(engine_() >> 11) * 0x1p-53; }
  Vector3d vector(double reach) {
    const double x = within(-reach, reach), y = within(-reach, reach), z = within(-reach, reach);
    return {x, y, z};
  }
  Vector3d noise(double sigma) {
    Vector3d out;
    for (int k = 0; k < 3; ++k)
      out[k] = sigma * std::sqrt(-2 * std::log(1 - within(0, 1))) * std::cos(within(0, 2 * std::numbers::pi));
    return out;
  }

 private:
  std::mt19937_64 engine_;
};

Pose motion(const Vector3d& rotation, const Vector3d& translation) {
  const double angle = rotation.norm();
  return {angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle)) : Eigen::Quaterniond::Identity(),
          translation};
}

}  // namespace

SimulatedMechanism simulated_mechanism(const SimulatedOptions& options) {
  Dice dice(options.seed);
  SimulatedMechanism out;
  out.guess = capture::paper_mechanism();
  out.truth = out.guess;
  const double reach = options.guess_error_m;
  for (std::size_t i = 0; i < out.truth.cables.size(); ++i) {
    capture::Cable& cable = out.truth.cables[i];
    cable.departure += dice.vector(reach);
    // Cables that share a point keep doing so.
    std::size_t first = 0;
    while (out.guess.cables[first].attachment != out.guess.cables[i].attachment) ++first;
    cable.attachment =
        first < i ? out.truth.cables[first].attachment : Vector3d(cable.attachment + dice.vector(reach / 5));
    out.offsets_m.push_back(dice.within(-0.3, 0.3));
    out.gains.push_back(1 + dice.within(-1, 1) * options.largest_gain_error);
  }
  out.truth.cam_from_platform =
      motion(dice.vector(options.guess_error_rad), dice.vector(reach)) * out.truth.cam_from_platform;
  for (int g = 0; g < options.groups; ++g)
    out.bearings_rad.push_back(2 * std::numbers::pi * g / options.groups +
                               (g > 0 ? dice.within(-1, 1) * options.guess_error_rad : 0));
  return out;
}

std::vector<capture::MechanismObservation> simulated_observations(const SimulatedMechanism& mechanism,
                                                                  const SimulatedOptions& options, std::uint64_t seed) {
  Dice dice(seed * 7919 + 13);
  std::vector<capture::MechanismObservation> out;
  const int each = std::max(1, options.observations / options.groups);
  for (int k = 0; k < options.observations; ++k) {
    capture::MechanismObservation o;
    o.name = "p" + std::to_string(k);
    o.bearing_group = std::min(k / each, options.groups - 1);
    o.bearing_rad = 2 * std::numbers::pi * o.bearing_group / options.groups;
    Pose platform;
    if (options.all_over_the_room) {
      platform.translation = {dice.within(-3.5, 3.5), dice.within(-4.5, 4.5), dice.within(0, 3)};
      const double about = dice.within(0, 2 * std::numbers::pi), tilt = dice.within(0, std::numbers::pi / 6);
      platform.rotation = Eigen::AngleAxisd(tilt, Vector3d(std::cos(about), std::sin(about), 0));
    } else {  // on the meridian, as exactly as the robot comes back (paper, 5.2: centimetres, degrees)
      platform = capture::platform_pose(Vector3d::Zero(), 1.5, o.bearing_rad, dice.within(0, std::numbers::pi / 2),
                                        2.0 / 3, -std::numbers::pi / 6);
      platform =
          Pose{platform.rotation * motion(dice.vector(0.03), {}).rotation, platform.translation + dice.vector(0.03)};
    }
    const double bearing = mechanism.bearings_rad[std::size_t(o.bearing_group)];
    o.cam_from_world = motion(dice.noise(options.rotation_noise_rad), dice.noise(options.position_noise_m)) *
                       (capture::cam_from_platform(mechanism.truth, bearing) * platform.inverse());
    const capture::CableVector lengths = capture::cable_lengths(mechanism.truth, platform);
    for (std::size_t i = 0; i < mechanism.offsets_m.size(); ++i)
      o.commanded_m.push_back((lengths[Eigen::Index(i)] - mechanism.offsets_m[i]) / mechanism.gains[i] +
                              dice.noise(options.length_noise_m).x());
    out.push_back(std::move(o));
  }
  return out;
}

double length_error_m(const capture::MechanismCalibration& calibration,
                      const std::vector<capture::MechanismObservation>& observations) {
  double squares = 0, count = 0;
  for (const capture::MechanismObservation& o : observations) {
    const auto group = std::find(calibration.bearing_groups.begin(), calibration.bearing_groups.end(), o.bearing_group);
    const double bearing = calibration.bearings_rad[std::size_t(group - calibration.bearing_groups.begin())];
    const Pose platform = o.cam_from_world.inverse() * capture::cam_from_platform(calibration.mechanism, bearing);
    const capture::CableVector lengths = capture::commanded_lengths(calibration, platform);
    for (std::size_t i = 0; i < o.commanded_m.size(); ++i) {
      const double d = lengths[Eigen::Index(i)] - o.commanded_m[i];
      squares += d * d, ++count;
    }
  }
  return std::sqrt(squares / count);
}

}  // namespace lumihull::test
