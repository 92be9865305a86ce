// Winches and the bearing's solenoid over the serial link.
#include <lumihull/base/error.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/motion.h>
#include <lumihull/capture/serial.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "serial_link.h"

namespace lumihull::capture {
namespace {

using namespace internal;
using Kind = SerialLink::Answer::Kind;

constexpr double kPoll_s = 0.1;
constexpr double kMargin_s = 5;        ///< beyond the time that the controller announced
constexpr int kTries = 3;              ///< of a request that got no reply
constexpr double kPoseEqual_m = 1e-6;  ///< of lengths, as check(Plan)
constexpr std::uint32_t kSetpoint_ms = 50;
constexpr std::array<double, 4> kSlower{1, 1.1, 1.4, 2};
constexpr double kRollEqual_rad = 1e-6;

struct Status {
  unsigned flags = 0;
  double to_go_s = 0;  ///< of a move
  std::vector<std::int32_t> lengths_um;
  bool has(unsigned bit) const { return flags & bit; }
};

std::int32_t micrometres(double metres, const std::string& subject) {
  const double um = metres * 1e6;
  if (!(std::abs(um) <= 1e8))
    throw Error(ErrorCode::invalid_argument, "a length must be finite and below 100 m", subject);
  return std::int32_t(std::llround(um));
}

class SerialRobot final : public Robot {
 public:
  SerialRobot(std::shared_ptr<SerialLink> link, const Mechanism& mechanism, SerialRobotOptions options)
      : link_(std::move(link)), mechanism_(mechanism), options_(std::move(options)) {
    check(mechanism_);
    if (!(options_.solenoid_s > 0 && options_.solenoid_s <= 60))
      throw Error(ErrorCode::invalid_argument, "must be 0 … 60 s", "SerialRobotOptions::solenoid_s");
    if (link_->controller().winches != mechanism_.cables.size())
      throw Error(ErrorCode::invalid_argument,
                  "the mechanism has " + std::to_string(mechanism_.cables.size()) + " cables, the controller " +
                      std::to_string(link_->controller().winches) + " winches",
                  link_->device());
  }
  ~SerialRobot() override { make_safe(); }

  State state() override;
  void move_to(const PlannedStop& stop, Job& job) override;
  void set_roll(double roll_rad, Job& job) override;
  void declare_position(const PlannedStop& stop) override;
  void make_safe() noexcept override;

 private:
  [[noreturn]] void fail(const std::string& what) const { throw Error(ErrorCode::io, what, link_->device()); }
  [[noreturn]] void fail_nak(const std::string& what, const SerialLink::Answer& answer) const;
  SerialLink::Answer ask(Type type, const Bytes& payload, const std::string& what);
  Status status();
  std::vector<std::int32_t> lengths_of(const PlannedStop& stop) const;
  Pose pose_of(const std::vector<std::int32_t>& lengths_um, const PlannedStop& to) const;
  std::vector<Bytes> setpoints(Move move, double factor, const std::vector<std::int32_t>& to_um) const;
  struct Begun {
    SerialLink::Answer answer;
    double seconds = 0;  ///< of an ACK: until it is there
  };
  Begun try_begin(const std::vector<Bytes>& setpoints, const std::vector<std::int32_t>& to_um);
  std::optional<double> begin(const std::vector<Bytes>& setpoints, const std::vector<std::int32_t>& to_um);
  double begin(const Status& now, const PlannedStop& stop, const std::vector<std::int32_t>& to_um);
  void append_lengths(Bytes& payload, const std::vector<std::int32_t>& lengths_um) const;
  void wait_for_rest(double patience_s, Job& job);

  std::shared_ptr<SerialLink> link_;
  Mechanism mechanism_;
  SerialRobotOptions options_;
  std::optional<Pose> at_;                                      ///< the last stop that was reached or declared
  std::vector<std::int32_t> at_um_;                             ///< and its lengths
  double roll_rad_ = std::numeric_limits<double>::quiet_NaN();  ///< nobody has said it yet
};

void SerialRobot::fail_nak(const std::string& what, const SerialLink::Answer& answer) const {
  std::string why = nak_words(answer.code);
  if ((answer.code == NakCode::limit || answer.code == NakCode::no_limits) && answer.detail >= 0 &&
      std::size_t(answer.detail) < mechanism_.cables.size())
    why += ", cable \"" + mechanism_.cables[std::size_t(answer.detail)].name + "\"";
  fail(what + ": " + why);
}

/// For requests that may be carried out twice without harm.
SerialLink::Answer SerialRobot::ask(Type type, const Bytes& payload, const std::string& what) {
  for (int i = 0; i < kTries; ++i) {
    auto answer = link_->request(type, payload);
    if (answer.kind == Kind::ack) return answer;
    if (answer.kind == Kind::nak) fail_nak(what, answer);
  }
  fail(what + ": the controller does not answer; check its power and the line");
}

Status SerialRobot::status() {
  const auto answer = ask(Type::status, {}, "state");
  PayloadReader in(answer.data);
  Status status;
  status.flags = in.u16();
  status.to_go_s = in.u32() * 1e-3;
  const unsigned n = in.u8();
  for (unsigned i = 0; i < n && in.ok(); ++i) status.lengths_um.push_back(in.i32());
  if (!in.ok() || n != mechanism_.cables.size()) fail("state: the reply is not as in the protocol");
  return status;
}

Robot::State SerialRobot::state() {
  State state;
  try {
    const Status now = status();
    state.moving = now.has(flag::moving);
    state.position_known = now.has(flag::position_known);
    if (state.position_known)
      for (const std::int32_t um : now.lengths_um) state.lengths_m.push_back(um * 1e-6);
    if (now.has(flag::emergency_stop)) state.fault = "the emergency stop is pressed";
    state.ready = state.fault.empty();
  } catch (const Error& e) {
    state.fault = e.what();
  }
  return state;
}

void SerialRobot::append_lengths(Bytes& payload, const std::vector<std::int32_t>& lengths_um) const {
  append_u8(payload, std::uint8_t(lengths_um.size()));
  for (const std::int32_t um : lengths_um) append_u32(payload, std::uint32_t(um));
}

std::vector<std::int32_t> SerialRobot::lengths_of(const PlannedStop& stop) const {
  if (stop.lengths_m.size() != mechanism_.cables.size())
    throw Error(ErrorCode::invalid_argument,
                "has " + std::to_string(stop.lengths_m.size()) + " cable lengths, the mechanism " +
                    std::to_string(mechanism_.cables.size()) + " cables",
                "stop \"" + stop.name + "\"");
  std::vector<std::int32_t> lengths_um;
  for (const double m : stop.lengths_m) lengths_um.push_back(micrometres(m, "stop \"" + stop.name + "\""));
  if (options_.straight) {
    const CableVector of_pose = cable_lengths(mechanism_, stop.world_from_platform);
    for (std::size_t i = 0; i < stop.lengths_m.size(); ++i)
      if (!(std::abs(of_pose[Eigen::Index(i)] - stop.lengths_m[i]) <= kPoseEqual_m))
        throw Error(ErrorCode::invalid_argument,
                    "the length of cable \"" + mechanism_.cables[i].name + "\" is not that of its pose",
                    "stop \"" + stop.name + "\"");
  }
  return lengths_um;
}

/// Where the platform is, with these lengths.
Pose SerialRobot::pose_of(const std::vector<std::int32_t>& lengths_um, const PlannedStop& to) const {
  if (at_ && lengths_um == at_um_) return *at_;
  std::vector<double> lengths_m;
  for (const std::int32_t um : lengths_um) lengths_m.push_back(um * 1e-6);
  try {
    return hang_rigid(mechanism_, lengths_m, at_.value_or(to.world_from_platform)).world_from_platform;
  } catch (const Error& e) {
    fail(std::string("move: its lengths do not tell where the platform is; declare the position (") + e.message() +
         ")");
  }
}

/// The payloads of the SETPOINTs of a straight move in `factor` times its time; none where there is nothing to do in
/// it.
std::vector<Bytes> SerialRobot::setpoints(Move move, double factor, const std::vector<std::int32_t>& to_um) const {
  move.profile = move.profile.slower(factor);
  const auto duration_ms = std::uint32_t(std::ceil(move.duration_s() * 1e3));
  const std::uint32_t most = std::min<std::uint32_t>(link_->controller().queue, 255);
  // Times are whole milliseconds, and lengths those of just these times: else rounding would look like acceleration.
  const std::uint32_t count = std::min(duration_ms / kSetpoint_ms + 1, most);
  std::vector<Bytes> payloads;
  std::uint32_t before_ms = 0;
  for (std::uint32_t k = 0; k < count && duration_ms >= count; ++k) {
    const auto at_ms = std::uint32_t(std::uint64_t(k + 1) * duration_ms / count);
    std::vector<std::int32_t> lengths_um = to_um;
    if (k + 1 < count) {
      const CableVector lengths_m = cable_lengths(mechanism_, pose_at(move, at_ms * 1e-3));
      for (std::size_t i = 0; i < lengths_um.size(); ++i)
        lengths_um[i] = micrometres(lengths_m[Eigen::Index(i)], "move");
    }
    Bytes& payload = payloads.emplace_back();
    append_u8(payload, std::uint8_t(k));
    append_u16(payload, std::uint16_t(at_ms - before_ms));
    append_lengths(payload, lengths_um);
    before_ms = at_ms;
  }
  return payloads;
}

/// Tells the setpoints, then START, or MOVE where there are none; the answer to the last that was said. Where there is
/// no reply nothing moves.
SerialRobot::Begun SerialRobot::try_begin(const std::vector<Bytes>& setpoints, const std::vector<std::int32_t>& to_um) {
  for (const Bytes& setpoint : setpoints) {
    const auto answer = link_->request(Type::setpoint, setpoint);
    if (answer.kind == Kind::nak) fail_nak("move", answer);
    if (answer.kind != Kind::ack) return {answer, 0};
  }
  Bytes payload;
  if (setpoints.empty())
    append_lengths(payload, to_um);
  else
    append_u8(payload, std::uint8_t(setpoints.size()));
  auto answer = link_->request(setpoints.empty() ? Type::move : Type::start, payload);
  if (answer.kind == Kind::ack) {
    PayloadReader in(answer.data);
    return {answer, in.u32() * 1e-3};
  }
  if (answer.kind == Kind::nak) return {answer, 0};
  // It may have begun all the same. What moves now, or stands there, can only be this.
  const Status now = status();
  if (now.has(flag::moving) || now.lengths_um == to_um) answer.kind = Kind::ack;
  return {answer, now.to_go_s};
}

/// Seconds until it is there; nothing: the controller finds this beyond its limits of speed and acceleration.
std::optional<double> SerialRobot::begin(const std::vector<Bytes>& setpoints, const std::vector<std::int32_t>& to_um) {
  for (int i = 0; i < kTries; ++i) {
    const auto [answer, seconds] = try_begin(setpoints, to_um);
    if (answer.kind == Kind::ack) return seconds;
    if (answer.kind == Kind::nak && answer.code == NakCode::limit && !setpoints.empty()) return std::nullopt;
    if (answer.kind == Kind::nak) fail_nak("move", answer);
  }
  fail("move: the controller does not answer; check its power and the line");
}

/// Seconds until it is there.
double SerialRobot::begin(const Status& now, const PlannedStop& stop, const std::vector<std::int32_t>& to_um) {
  if (!options_.straight) return *begin({}, to_um);  // of a MOVE the controller finds the time
  const Move move = plan_move(mechanism_, pose_of(now.lengths_um, stop), stop.world_from_platform);
  // The cubic between setpoints may exceed the profile's acceleration a little; then the same way takes more time.
  for (const double factor : kSlower)
    if (const auto seconds = begin(setpoints(move, factor, to_um), to_um)) return *seconds;
  fail("move: " + nak_words(NakCode::limit) + " of the winches, even in twice the planned time");
}

void SerialRobot::wait_for_rest(double patience_s, Job& job) {
  for (double waited_s = 0;; waited_s += kPoll_s) {
    job.check();
    if (!status().has(flag::moving)) return;
    if (waited_s > patience_s) fail("move: takes longer than the controller announced");
    link_->sleep(kPoll_s);
  }
}

void SerialRobot::move_to(const PlannedStop& stop, Job& job) {
  job.check();
  const auto to_um = lengths_of(stop);
  try {
    const Status before = status();
    if (!before.has(flag::position_known)) fail("move: " + nak_words(NakCode::position));
    wait_for_rest(begin(before, stop, to_um) + kMargin_s, job);
    const Status after = status();
    if (after.has(flag::emergency_stop)) fail("move: " + nak_words(NakCode::stopped));
    if (!after.has(flag::position_known)) fail("move: the controller restarted on the way; the position is not known");
    if (after.has(flag::broken_off) || after.lengths_um != to_um)
      fail(after.has(flag::host_lost) ? "move: broken off, for the controller did not hear this program for 1.5 s"
                                      : "move: broken off before its end");
    at_ = stop.world_from_platform;
    at_um_ = to_um;
  } catch (...) {
    make_safe();
    throw;
  }
}

void SerialRobot::set_roll(double roll_rad, Job& job) {
  job.check();
  if (std::abs(roll_rad - roll_rad_) <= kRollEqual_rad) return;
  const double limit_s = link_->controller().max_solenoid_ms * 1e-3;
  Bytes payload;
  append_u32(payload, std::uint32_t(std::llround(options_.solenoid_s * 1e3)));
  try {
    // Busy: it rests from the turn before, as long as its longest time.
    for (double waited_s = 0;; waited_s += kPoll_s) {
      job.check();
      const auto answer = link_->request(Type::solenoid, payload);
      if (answer.kind != Kind::nak) roll_rad_ = std::numeric_limits<double>::quiet_NaN();  // it may turn now
      if (answer.kind == Kind::ack) break;
      if (answer.kind != Kind::nak) fail("bearing: the controller does not answer; check its power and the line");
      if (answer.code != NakCode::busy || waited_s > 2 * limit_s) fail_nak("bearing", answer);
      link_->sleep(kPoll_s);
    }
    for (double waited_s = 0; status().has(flag::solenoid); waited_s += kPoll_s) {
      job.check();
      if (waited_s > options_.solenoid_s + kMargin_s) fail("bearing: the solenoid stays on");
      link_->sleep(kPoll_s);
    }
  } catch (...) {
    make_safe();
    throw;
  }
  roll_rad_ = roll_rad;
}

void SerialRobot::declare_position(const PlannedStop& stop) {
  const auto lengths_um = lengths_of(stop);
  const MotionLimits& limits = mechanism_.limits;
  for (std::size_t i = 0; i < mechanism_.cables.size(); ++i) {
    const Cable& cable = mechanism_.cables[i];
    Bytes payload;
    append_u8(payload, std::uint8_t(i));
    for (const double value :
         {cable.min_length_m, cable.max_length_m, limits.cable_speed_m_s, limits.cable_acceleration_m_s2})
      append_u32(payload, std::uint32_t(micrometres(value, "cable \"" + cable.name + "\"")));
    ask(Type::limits, payload, "limits of the mechanism");
  }
  Bytes payload;
  append_lengths(payload, lengths_um);
  ask(Type::declare, payload, "declare position");
  roll_rad_ = stop.roll_rad;
  at_ = stop.world_from_platform;
  at_um_ = lengths_um;
}

void SerialRobot::make_safe() noexcept {
  try {
    ask(Type::stop, {stop_what::moves | stop_what::solenoid}, "stop");
  } catch (...) {
    // The port is gone: the controller hears no heartbeat and does it by itself.
  }
}

}  // namespace

std::unique_ptr<Robot> open_serial_robot(std::shared_ptr<SerialLink> link, const Mechanism& mechanism,
                                         const SerialRobotOptions& options) {
  return std::make_unique<SerialRobot>(std::move(link), mechanism, options);
}

}  // namespace lumihull::capture
