// What a plan may contain.
#include <lumihull/base/error.h>
#include <lumihull/capture/plan.h>
#include <lumihull/capture/statics.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string_view>

namespace lumihull::capture {
namespace {

constexpr double kLengthTolerance_m = 1e-6;
constexpr double kLongestTime_s = 86400;
constexpr std::size_t kLongestName = 100, kLongestPause = 500;

/// Complains about one field.
class Field {
 public:
  Field(const std::string& subject, std::string pointer) : subject_(subject), pointer_(std::move(pointer)) {}

  [[noreturn]] void fail(const std::string& expected) const {
    throw Error(ErrorCode::bad_input, "at " + pointer_ + ": expected " + expected, subject_);
  }
  Field at(std::string_view name) const { return {subject_, pointer_ + "/" + std::string(name)}; }
  Field at(std::size_t index) const { return {subject_, pointer_ + "/" + std::to_string(index)}; }

  void between(double value, double low, double high) const {
    if (std::isfinite(value) && value >= low && value <= high) return;
    char text[120];
    std::snprintf(text, sizeof text, "a number from %g to %g, not %g", low, high, value);
    fail(text);
  }
  /// Photographs are named after stops and cameras, on whatever disk.
  void file_name(const std::string& name) const {
    const auto plain = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
             c == '.';
    };
    if (name.empty() || name.size() > kLongestName || name[0] == '.' || !std::all_of(name.begin(), name.end(), plain))
      fail("a name of letters, digits, '-', '_' and '.', not beginning with '.', of at most " +
           std::to_string(kLongestName) + " characters");
  }
  void pose(const Pose& pose) const {
    for (int k = 0; k < 3; ++k) at("t").at(std::size_t(k)).between(pose.translation[k], -1e6, 1e6);
    if (!(std::abs(pose.rotation.norm() - 1) <= 1e-6)) at("q").fail("a quaternion of length 1");
  }

 private:
  const std::string& subject_;
  std::string pointer_;
};

void check_lengths(const Field& field, const Mechanism& mechanism, const PlannedStop& stop) {
  const CableVector lengths = cable_lengths(mechanism, stop.world_from_platform);
  if (std::ptrdiff_t(stop.lengths_m.size()) != lengths.size())
    field.fail(std::to_string(lengths.size()) + " lengths, one a cable");
  for (std::size_t i = 0; i < stop.lengths_m.size(); ++i) {
    const Cable& cable = mechanism.cables[i];
    const double l = stop.lengths_m[i], wanted = lengths[Eigen::Index(i)];
    char text[200];
    if (!(std::abs(l - wanted) <= kLengthTolerance_m)) {
      std::snprintf(text, sizeof text, "%.6f m, the length that the pose asks for, not %g", wanted, l);
      field.at(i).fail(text);
    }
    if (l < cable.min_length_m || l > cable.max_length_m) {
      std::snprintf(text, sizeof text, "what the winch can do, %g to %g m, not %.3f", cable.min_length_m,
                    cable.max_length_m, l);
      field.at(i).fail(text);
    }
  }
}

void check_stop(const Field& field, const Plan& plan, const PlannedStop& stop) {
  field.at("name").file_name(stop.name);
  field.at("theta_rad").between(stop.theta_rad, -100, 100);
  field.at("phi_rad").between(stop.phi_rad, 0, 3.1415926535897936);
  field.at("roll_rad").between(stop.roll_rad, -100, 100);
  field.at("world_from_platform").pose(stop.world_from_platform);
  field.at("cam_from_world").pose(stop.cam_from_world);
  field.at("travel_s").between(stop.travel_s, 0, kLongestTime_s);
  field.at("settle_s").between(stop.settle_s, 0, kLongestTime_s);
  field.at("exposure_s").between(stop.exposure_s, 0, kLongestTime_s);
  if (stop.photograph && !(stop.exposure_s > 0))
    field.at("exposure_s").fail("a positive number where a photograph is taken");
  if (stop.pause.size() > kLongestPause ||
      std::any_of(stop.pause.begin(), stop.pause.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    field.at("pause").fail("one line of at most " + std::to_string(kLongestPause) + " bytes");
  if (plan.mechanism) {
    const Eigen::AlignedBox3d& room = plan.mechanism->room;
    if (!room.contains(stop.world_from_platform.translation))
      field.at("world_from_platform").at("t").fail("a place in the room");
    check_lengths(field.at("lengths_m"), *plan.mechanism, stop);
  } else if (!stop.lengths_m.empty()) {
    field.at("lengths_m").fail("no lengths without a mechanism");
  }
}

void check_unique(const Field& field, const std::string& name, std::set<std::string_view>& taken) {
  if (!taken.insert(name).second) field.fail("a name that no other one has, not \"" + name + "\"");
}

}  // namespace

void check(const Plan& plan, const std::string& subject) {
  const Field top(subject, "");
  if (plan.robot != "cables" && plan.robot != "turntable" && plan.robot != "hand")
    top.at("robot").fail("\"cables\", \"turntable\" or \"hand\"");
  if ((plan.robot == "cables") != plan.mechanism.has_value())
    top.at("mechanism").fail(plan.mechanism ? "no mechanism for a " + plan.robot : "the mechanism of the cables");
  if (plan.mechanism) check(*plan.mechanism, subject);
  if (plan.object) {
    const Field object = top.at("object");
    for (int k = 0; k < 3; ++k) object.at("base").at(std::size_t(k)).between(plan.object->base[k], -1e6, 1e6);
    object.at("radius_m").between(plan.object->radius_m, 1e-6, 1e4);
    object.at("height_m").between(plan.object->height_m, 0, 1e4);
  }
  const Field cameras = top.at("cameras"), stops = top.at("stops");
  if (plan.cameras.empty() || plan.cameras.size() > kMaxPlannedCameras)
    cameras.fail("1 to " + std::to_string(kMaxPlannedCameras) + " names");
  std::set<std::string_view> taken;
  for (std::size_t i = 0; i < plan.cameras.size(); ++i) {
    cameras.at(i).file_name(plan.cameras[i]);
    check_unique(cameras.at(i), plan.cameras[i], taken);
  }
  if (plan.stops.empty() || plan.stops.size() > kMaxPlannedStops)
    stops.fail("1 to " + std::to_string(kMaxPlannedStops) + " stops");
  taken.clear();
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    check_stop(stops.at(i), plan, plan.stops[i]);
    check_unique(stops.at(i).at("name"), plan.stops[i].name, taken);
  }
  if (std::none_of(plan.stops.begin(), plan.stops.end(), [](const PlannedStop& s) { return s.photograph; }))
    stops.fail("a stop where a photograph is taken");
}

double duration_s(const Plan& plan) {
  double total = 0;
  for (const PlannedStop& stop : plan.stops) total += stop.travel_s + stop.settle_s + stop.exposure_s;
  return total;
}

}  // namespace lumihull::capture
