#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/forward.h>
#include <lumihull/rig/rig_robot.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "objects/noise.h"

namespace lumihull::rig {

using capture::PlannedStop;
using Eigen::Vector3d;

namespace {

std::uint64_t hash_of(const std::string& text) {
  std::uint64_t h = 0xcbf29ce484222325ull;  // FNV-1a
  for (const char c : text) h = (h ^ std::uint8_t(c)) * 0x100000001b3ull;
  return h;
}

/// Numbers that belong to one thing, one after the other.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t what) : seed_(mix(mix(seed, 0x70b07), what)) {}
  double gauss() { return double(gaussian(mix(seed_, n_++))); }
  double turn() { return 2 * std::numbers::pi * unit_double(mix(seed_, n_++)); }
  Vector3d vector() {
    const double x = gauss(), y = gauss(), z = gauss();
    return {x, y, z};
  }

 private:
  std::uint64_t seed_, n_ = 0;
};

Pose small_motion(const Vector3d& shift, const Vector3d& turn) {
  const double angle = turn.norm();
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, angle > 0 ? Vector3d(turn / angle) : Vector3d::UnitZ())), shift};
}

constexpr double kTurn_s = 2;  ///< of the camera in its bearing

enum Thing : std::uint64_t { kDeparture = 1, kAttachment, kWinch, kMount, kArrival, kBearing, kSwing, kPlace };

std::uint64_t thing(Thing kind, std::uint64_t which) { return mix(std::uint64_t(kind), which); }

[[noreturn]] void broken(const std::filesystem::path& file) {
  throw Error(ErrorCode::bad_input, "is not what a virtual robot left there", file.string());
}

}  // namespace

RobotErrors RobotErrors::none() {
  RobotErrors e;
  e.departure_m = e.attachment_m = e.offset_m = e.gain = e.winch_m = e.common_m = 0;
  e.mount_m = e.mount_rad = e.bearing_rad = 0;
  e.table_m = e.table_rad = e.hand_m = e.hand_rad = 0;
  e.swing_m = e.swing_rad = 0;
  return e;
}

RigRobot::RigRobot(const capture::Plan& plan, const Options& options)
    : kind_(plan.robot), mechanism_(plan.mechanism), options_(options), woke_(std::chrono::steady_clock::now()) {
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    index_of_stop_.emplace(plan.stops[i].name, int(i));
    travel_s_.push_back(plan.stops[i].travel_s);
    turn_s_.push_back(i == 0 || plan.stops[i].roll_rad != plan.stops[i - 1].roll_rad ? kTurn_s : 0);
  }
  const RobotErrors& e = options_.errors;
  for (const double x :
       {e.departure_m, e.attachment_m, e.offset_m, e.gain, e.winch_m, e.common_m, e.mount_m, e.mount_rad, e.bearing_rad,
        e.table_m, e.table_rad, e.hand_m, e.hand_rad, e.swing_m, e.swing_rad})
    if (!(x >= 0 && x <= 1)) throw Error(ErrorCode::invalid_argument, "expected errors from 0 to 1", "robot");
  if (!(e.swing_period_s > 0 && e.swing_decay_s > 0) || !std::isfinite(e.swing_period_s + e.swing_decay_s))
    throw Error(ErrorCode::invalid_argument, "expected positive times of the swing", "robot");
  if (mechanism_) {
    true_mechanism_ = mechanism_;
    for (std::size_t i = 0; i < mechanism_->cables.size(); ++i) {
      Draws a(e.seed, thing(kDeparture, i)), b(e.seed, thing(kAttachment, i));
      true_mechanism_->cables[i].departure += e.departure_m * a.vector();
      true_mechanism_->cables[i].attachment += e.attachment_m * b.vector();
    }
  }
  Draws mount(e.seed, thing(kMount, 0));
  const Vector3d shift = e.mount_m * mount.vector();
  mount_ = mechanism_ ? small_motion(shift, e.mount_rad * mount.vector()) : Pose{};
  recall();
}

capture::Robot::State RigRobot::state() {
  return {.ready = true, .moving = false, .position_known = true, .lengths_m = memory_.lengths_m, .fault = {}};
}

std::uint64_t RigRobot::place_of(const PlannedStop& stop) const {
  if (!mechanism_) return hash_of(stop.name);
  std::uint64_t place = 1;
  for (const double length : stop.lengths_m) place = mix(place, std::uint64_t(std::llround(length * 1e6)));
  return place;
}

/// Where the platform comes to rest; without a mechanism where the camera is.
Pose RigRobot::rest_of(const PlannedStop& stop, int visit) const {
  const RobotErrors& e = options_.errors;
  Draws draws(e.seed, mix(thing(kArrival, place_of(stop)), std::uint64_t(visit)));
  if (!mechanism_) {
    const bool table = kind_ == "turntable";
    const Vector3d shift = (table ? e.table_m : e.hand_m) * draws.vector();
    return stop.cam_from_world.inverse() * small_motion(shift, (table ? e.table_rad : e.hand_rad) * draws.vector());
  }
  std::vector<double> lengths = stop.lengths_m;
  const double common = e.common_m * draws.gauss();
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    Draws winch(e.seed, thing(kWinch, i));
    const double offset = e.offset_m * winch.gauss(), gain = e.gain * winch.gauss();
    lengths[i] += offset + gain * lengths[i] + common + e.winch_m * draws.gauss();
  }
  return capture::hang_rigid(*true_mechanism_, lengths, stop.world_from_platform).world_from_platform;
}

void RigRobot::arrive(const PlannedStop& stop, double swing) {
  const std::uint64_t place = place_of(stop);
  const bool moved = memory_.visit == 0 || place != memory_.place;
  memory_.stop = stop.name;
  if (moved) {
    memory_.place = place;
    memory_.visit = ++memory_.visits[place];
    memory_.lengths_m = stop.lengths_m;
    memory_.commanded = mechanism_ ? stop.world_from_platform : stop.cam_from_world;
    memory_.arrived_s = memory_.still_s = memory_.clock_s;
    memory_.swing = swing;
    rest_ = rest_of(stop, memory_.visit);
  }
  remember();
}

std::optional<int> RigRobot::index_of(const std::string& stop) const {
  const auto known = index_of_stop_.find(stop);
  return known == index_of_stop_.end() ? std::nullopt : std::optional(known->second);
}

/// Lets the time pass that the way to a stop takes by the plan, with ways and turns that were left out before it, in
/// the plan's order, so that sums are the same to the last bit. What is no stop of the plan, or lies behind, is on a
/// way that only a session takes that goes on.
void RigRobot::travel(const PlannedStop& stop) {
  Memory& m = memory_;
  for (const int to = index_of(stop.name).value_or(-1); m.reached < to;) {
    if (m.turned < m.reached) m.clock_s += turn_s_[std::size_t(m.turned = m.reached)];
    m.clock_s += travel_s_[std::size_t(++m.reached)];
  }
}

void RigRobot::move_to(const PlannedStop& stop, Job& job) {
  job.check();
  tick();
  travel(stop);
  // A short way ends slowly: the swing is in proportion, up to that of 2 s of travel.
  arrive(stop, std::min(1., stop.travel_s / 2));
}

void RigRobot::set_roll(double roll_rad, Job& job) {
  job.check();
  tick();
  if (const auto here = index_of(memory_.stop); here && *here > memory_.turned) {
    memory_.turned = *here;
    memory_.still_s = memory_.clock_s += turn_s_[std::size_t(*here)];
  }
  memory_.roll_rad = roll_rad;
  memory_.turned_at = memory_.stop;
  remember();
}

void RigRobot::declare_position(const PlannedStop& stop) { arrive(stop, 0); }

double RigRobot::now_s() const {
  const std::chrono::duration<double> awake = std::chrono::steady_clock::now() - woke_;
  return memory_.clock_s + (options_.real_time ? awake.count() : 0);
}

/// Takes what has passed on the wall into the clock.
void RigRobot::tick() {
  memory_.clock_s = now_s();
  woke_ = std::chrono::steady_clock::now();
}

void RigRobot::pass(double seconds) {
  tick();
  memory_.clock_s += seconds;
  remember();
}

void RigRobot::pass_until(double time_s) { pass(std::max(0., time_s - now_s())); }

void RigRobot::settle(double seconds) { pass_until(memory_.still_s + seconds); }

/// Swing of a pendulum with several modes, each with its own period and phase; the tilt goes with the shift.
Pose RigRobot::platform_at(double time_s) const {
  const RobotErrors& e = options_.errors;
  const double since = time_s - memory_.arrived_s;
  if (!mechanism_ || memory_.swing <= 0 || since < 0) return rest_;
  Draws draws(e.seed, mix(thing(kSwing, memory_.place), std::uint64_t(memory_.visit)));
  const double size = memory_.swing * std::exp(-since / e.swing_decay_s);
  const auto mode = [&](double slower) {
    return std::sin(2 * std::numbers::pi * since / (slower * e.swing_period_s) + draws.turn());
  };
  const double along = mode(1), across = mode(1.07), up = mode(.61), twist = mode(.83);
  const double direction = draws.turn(), c = std::cos(direction), s = std::sin(direction);
  const double x = c * along - .6 * s * across, y = s * along + .6 * c * across;
  const Vector3d shift = e.swing_m * size * Vector3d(x, y, .2 * up);
  const Vector3d turn = e.swing_rad * size * Vector3d(-y, x, .7 * twist);
  // In world axes, about the platform's origin.
  Pose pose = rest_;
  pose.translation += shift;
  pose.rotation = (small_motion({0, 0, 0}, turn).rotation * pose.rotation).normalized();
  return pose;
}

Pose RigRobot::camera_on(const Pose& platform, double roll_rad, const std::string& turned_at) const {
  if (!mechanism_) return platform.inverse();
  Draws draws(options_.errors.seed, mix(thing(kBearing, hash_of(turned_at)), std::bit_cast<std::uint64_t>(roll_rad)));
  const double roll = roll_rad + options_.errors.bearing_rad * draws.gauss();
  return mount_ * capture::cam_from_platform(*mechanism_, roll) * platform.inverse();
}

Pose RigRobot::cam_from_world(double time_s) const {
  return camera_on(platform_at(time_s), memory_.roll_rad, memory_.turned_at);
}

Pose RigRobot::cam_from_world_at_rest() const { return camera_on(rest_, memory_.roll_rad, memory_.turned_at); }

RigRobot::Standing RigRobot::foreseen(const PlannedStop& stop, int visit) const {
  const Pose rest = rest_of(stop, visit);
  const Pose mount = mechanism_ ? mount_ * capture::cam_from_platform(*mechanism_, stop.roll_rad) : Pose{};
  return {mount * rest.inverse(), cables_to(rest)};
}

std::vector<RigRobot::CableLine> RigRobot::cables(double time_s) const { return cables_to(platform_at(time_s)); }

std::vector<RigRobot::CableLine> RigRobot::cables_to(const Pose& platform) const {
  std::vector<CableLine> lines;
  if (!true_mechanism_) return lines;
  for (const capture::Cable& cable : true_mechanism_->cables)
    lines.push_back({cable.departure, platform * cable.attachment});
  return lines;
}

// ---- what outlives the program
// ----------------------------------------------------------------------------------------

void RigRobot::remember() const {
  if (options_.memory.empty()) return;
  std::ostringstream text;
  text.precision(17);
  const Memory& m = memory_;
  const Eigen::Quaterniond& q = m.commanded.rotation;
  const Vector3d& t = m.commanded.translation;
  text << "rig-robot 2\n"
       << "stop " << m.stop << "\nreached " << m.reached << ' ' << m.turned << "\nvisit " << m.visit << ' ' << m.place
       << "\nclock " << m.clock_s << ' ' << m.arrived_s << ' ' << m.still_s << ' ' << m.swing << "\nroll " << m.roll_rad
       << ' ' << m.turned_at << "\npose " << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << t.x()
       << ' ' << t.y() << ' ' << t.z() << "\nlengths";
  for (const double length : m.lengths_m) text << ' ' << length;
  text << '\n';
  for (const auto& [place, n] : m.visits) text << "been " << n << ' ' << place << '\n';
  text << "end\n";
  // Not a result but a machine's state: it must not be torn, it need not survive a power cut.
  const std::filesystem::path aside = options_.memory.string() + ".new";
  std::ofstream out(aside);
  out << text.str();
  out.close();
  if (!out) throw Error(ErrorCode::io, "can't be written: is the disk full?", aside);
  std::filesystem::rename(aside, options_.memory);
}

void RigRobot::recall() {
  if (options_.memory.empty() || !std::filesystem::exists(options_.memory)) return;
  std::istringstream in(read_file(options_.memory, std::size_t(64) << 20));
  std::string line, word;
  if (!std::getline(in, line) || line != "rig-robot 2") broken(options_.memory);
  Memory m;
  bool whole = false;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    words >> word;
    const auto rest = [&] {
      std::string text;
      std::getline(words >> std::ws, text);
      words.clear();
      return text;
    };
    if (word == "stop") {
      m.stop = rest();
    } else if (word == "reached") {
      words >> m.reached >> m.turned;
    } else if (word == "visit") {
      words >> m.visit >> m.place;
    } else if (word == "clock") {
      words >> m.clock_s >> m.arrived_s >> m.still_s >> m.swing;
    } else if (word == "roll") {
      words >> m.roll_rad;
      m.turned_at = rest();
    } else if (word == "pose") {
      Eigen::Quaterniond& q = m.commanded.rotation;
      Vector3d& t = m.commanded.translation;
      words >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z();
    } else if (word == "lengths") {
      for (double length = 0; words >> length;) m.lengths_m.push_back(length);
      words.clear();
    } else if (word == "been") {
      int n = 0;
      std::uint64_t place = 0;
      words >> n >> place;
      m.visits[place] = n;
    } else if (word == "end") {
      whole = true;
    }
    if (!words) broken(options_.memory);
  }
  if (!whole || std::min(m.reached, m.turned) < -1 || std::max(m.reached, m.turned) >= int(travel_s_.size()) ||
      (mechanism_ && !m.lengths_m.empty() && m.lengths_m.size() != mechanism_->cables.size()))
    broken(options_.memory);
  memory_ = m;
  if (m.stop.empty()) return;
  PlannedStop stop;
  stop.name = m.stop;
  stop.lengths_m = m.lengths_m;
  stop.world_from_platform = m.commanded;
  if (!mechanism_) stop.cam_from_world = m.commanded;
  rest_ = rest_of(stop, m.visit);
}

}  // namespace lumihull::rig
