// What a mechanism must be, and the paper's.
#include <lumihull/base/error.h>
#include <lumihull/capture/mechanism.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

namespace lumihull::capture {
namespace {

constexpr double kFar_m = 1000;     ///< no room is larger
constexpr double kOnWall_m = 1e-3;  ///< a pulley may stand this much behind the wall

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

/// Complaints name the place as a JSON pointer, the same whether the mechanism came from a file or from a program.
class Checker {
 public:
  explicit Checker(const std::string& subject) : subject_(subject) {}

  [[noreturn]] void fail(const std::string& pointer, const std::string& expected) const {
    throw Error(ErrorCode::bad_input, "at " + pointer + ": expected " + expected, subject_);
  }
  void range(const std::string& pointer, double value, double low, double high) const {
    if (!(value >= low && value <= high)) fail(pointer, "a number from " + text(low) + " to " + text(high));
  }
  void positive(const std::string& pointer, double value, double high) const {
    if (!(value > 0 && value <= high)) fail(pointer, "a positive number of at most " + text(high));
  }
  void point(const std::string& pointer, const Eigen::Vector3d& value) const {
    if (!(value.cwiseAbs().maxCoeff() <= kFar_m) || !value.allFinite())
      fail(pointer, "a point within " + text(kFar_m) + " m");
  }

 private:
  const std::string& subject_;
};

void check_cable(const Checker& checker, const std::string& at, const Cable& cable, const Eigen::AlignedBox3d& room) {
  checker.point(at + "/departure", cable.departure);
  checker.point(at + "/attachment", cable.attachment);
  if ((cable.departure - room.min()).minCoeff() < -kOnWall_m || (room.max() - cable.departure).minCoeff() < -kOnWall_m)
    checker.fail(at + "/departure", "a point in the room or on its walls");
  checker.range(at + "/min_length_m", cable.min_length_m, 0, kFar_m);
  checker.positive(at + "/max_length_m", cable.max_length_m, 10 * kFar_m);
  if (!(cable.min_length_m < cable.max_length_m)) checker.fail(at + "/max_length_m", "more than min_length_m");
  checker.range(at + "/min_tension_N", cable.min_tension_N, 0, 1e6);
  checker.positive(at + "/max_tension_N", cable.max_tension_N, 1e6);
  if (!(cable.min_tension_N < cable.max_tension_N)) checker.fail(at + "/max_tension_N", "more than min_tension_N");
  checker.range(at + "/stiffness_N", cable.stiffness_N, 0, 1e12);
  checker.range(at + "/density_kg_m", cable.density_kg_m, 0, 1e3);
}

}  // namespace

void check(const Mechanism& mechanism, const std::string& subject) {
  const Checker checker(subject);
  if (mechanism.name.size() > 256) checker.fail("/name", "at most 256 bytes");
  checker.point("/room/min", mechanism.room.min());
  checker.point("/room/max", mechanism.room.max());
  if (!(mechanism.room.sizes().minCoeff() > 0)) checker.fail("/room/max", "more than /room/min in each coordinate");
  const std::size_t count = mechanism.cables.size();
  if (count < 3 || count > 12) checker.fail("/cables", "3 to 12 cables");
  std::set<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    const Cable& cable = mechanism.cables[i];
    const std::string at = "/cables/" + std::to_string(i);
    if (cable.name.empty() || cable.name.size() > 64) checker.fail(at + "/name", "1 to 64 bytes");
    if (!names.insert(cable.name).second) checker.fail(at + "/name", "a name that no other cable has");
    check_cable(checker, at, cable, mechanism.room);
  }
  checker.positive("/mass_kg", mechanism.mass_kg, 1e5);
  checker.point("/center_of_mass", mechanism.center_of_mass);
  checker.range("/platform_radius_m", mechanism.platform_radius_m, 0, kFar_m);
  checker.range("/cable_radius_m", mechanism.cable_radius_m, 0, 1);
  checker.positive("/gravity_m_s2", mechanism.gravity_m_s2, 1e3);
  const MotionLimits& limits = mechanism.limits;
  const std::array<std::pair<const char*, double>, 5> motions = {
      {{"speed_m_s", limits.speed_m_s},
       {"acceleration_m_s2", limits.acceleration_m_s2},
       {"jerk_m_s3", limits.jerk_m_s3},
       {"cable_speed_m_s", limits.cable_speed_m_s},
       {"cable_acceleration_m_s2", limits.cable_acceleration_m_s2}}};
  for (const auto& [name, value] : motions) checker.positive(std::string("/limits/") + name, value, 1e6);
  if (!(std::abs(mechanism.cam_from_platform.rotation.norm() - 1) <= 1e-6))
    checker.fail("/cam_from_platform/q", "a quaternion of length 1");
  checker.point("/cam_from_platform/t", mechanism.cam_from_platform.translation);
}

}  // namespace lumihull::capture
