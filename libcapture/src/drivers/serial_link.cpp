#include "serial_link.h"

#include <lumihull/base/error.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

namespace lumihull::capture {

using namespace internal;

namespace {

constexpr std::array<double, 3> kPatience_s{0.25, 0.5, 1.0};
constexpr double kHeartbeat_s = 0.5;
constexpr std::size_t kFiredKept = 64;

SerialOptions checked(const SerialOptions& options) {
  if (options.device.empty()) throw Error(ErrorCode::invalid_argument, "names no serial port", "SerialOptions::device");
  if (!(options.time_scale >= 1 && options.time_scale <= 1000))
    throw Error(ErrorCode::invalid_argument, "must be 1 … 1000", "SerialOptions::time_scale");
  return options;
}

bool is_reply(const Frame& frame, Type to) {
  return (frame.type == std::uint8_t(Type::ack) || frame.type == std::uint8_t(Type::nak)) && !frame.payload.empty() &&
         frame.payload[0] == std::uint8_t(to);
}

NakCode code_of(const Frame& frame) {
  return frame.type == std::uint8_t(Type::nak) && frame.payload.size() >= 2 ? NakCode(frame.payload[1]) : NakCode::none;
}

}  // namespace

std::string nak_words(NakCode code) {
  switch (code) {
    case NakCode::limit:
      return "beyond a limit";
    case NakCode::busy:
      return "busy: something moves, is exposed, or the solenoid is on or rests";
    case NakCode::stopped:
      return "the emergency stop is pressed";
    case NakCode::position:
      return "the position is not known: it has to be declared first";
    case NakCode::no_limits:
      return "the controller has no limits yet: the position has to be declared first";
    case NakCode::shot_old:
      return "the shot's number is older than what the controller remembers";
    case NakCode::type:
      return "the controller does not know this request";
    default:
      return "the controller refuses with code " + std::to_string(int(code));
  }
}

SerialLink::SerialLink(const SerialOptions& options)
    : time_scale_(checked(options).time_scale),
      session_(std::random_device{}()),
      port_(options.device, options.baud),
      sequence_(std::uint16_t(std::random_device{}())) {
  listener_ = std::thread([this] { listen(); });
  try {
    // A second HELLO: the controller may have been starting during the first.
    if (!hello() && !hello())
      throw Error(
          ErrorCode::io,
          "no controller answers: check its power, the cable and the baud rate (" + std::to_string(options.baud) + ")",
          options.device);
  } catch (...) {
    ending_ = true;
    port_.wake();
    listener_.join();
    throw;
  }
}

SerialLink::~SerialLink() {
  ending_ = true;
  port_.wake();
  listener_.join();
}

std::chrono::nanoseconds SerialLink::scaled(double seconds) const {
  return std::chrono::nanoseconds(std::llround(seconds / time_scale_ * 1e9));
}

SerialLink::Controller SerialLink::controller() const {
  const std::lock_guard lock(mutex_);
  return controller_;
}

void SerialLink::check() const {
  const std::lock_guard lock(mutex_);
  check_port();
}

void SerialLink::check_port() const {
  if (lost_) std::rethrow_exception(lost_);
}

// ---- asking ----

void SerialLink::send(const Frame& frame) {
  const Bytes wire = encode_frame(frame);
  const std::lock_guard lock(writing_);
  port_.write(wire);
}

std::optional<Frame> SerialLink::exchange(const Frame& request) {
  std::unique_lock lock(mutex_);
  asked_ = &request;
  reply_.reset();
  for (const double patience : kPatience_s) {
    if (lost_) break;
    lock.unlock();
    try {
      send(request);
    } catch (...) {
      lock.lock();
      asked_ = nullptr;
      throw;
    }
    lock.lock();
    if (news_.wait_for(lock, scaled(patience), [this] { return reply_ || lost_; })) break;
  }
  asked_ = nullptr;
  check_port();
  return std::exchange(reply_, std::nullopt);
}

bool SerialLink::hello() {
  Frame frame;
  frame.type = std::uint8_t(Type::hello);
  frame.sequence = ++sequence_;
  append_u32(frame.payload, session_);
  const auto reply = exchange(frame);
  if (!reply) return false;
  if (code_of(*reply) == NakCode::version)
    throw Error(ErrorCode::io,
                "the controller speaks version " + std::to_string(reply->version) +
                    " of the protocol, this program version 1: use a program or firmware that match",
                device());
  PayloadReader in(reply->payload);
  in.u8();   // type
  in.u32();  // session
  in.u32();  // uptime
  Controller controller;
  controller.nonce = reply->nonce;
  controller.winches = in.u8();
  controller.queue = in.u8();
  controller.max_exposure_ms = in.u32();
  controller.max_solenoid_ms = in.u32();
  if (!in.ok() || reply->type != std::uint8_t(Type::ack)) return false;

  const std::lock_guard lock(mutex_);
  if (controller.nonce != controller_.nonce) fired_.clear();
  controller_ = controller;
  linked_ = true;
  return true;
}

SerialLink::Answer SerialLink::request(Type type, const Bytes& payload) {
  const std::lock_guard one(one_request_);
  Answer answer;
  bool linked = false;
  {
    const std::lock_guard lock(mutex_);
    check_port();
    linked = linked_;
  }
  if (!linked && !hello()) return answer;

  Frame frame;
  frame.type = std::uint8_t(type);
  frame.nonce = answer.nonce = controller().nonce;
  frame.sequence = ++sequence_;
  frame.payload = payload;
  const auto reply = exchange(frame);
  const NakCode code = reply ? code_of(*reply) : NakCode::none;
  if (!reply || code == NakCode::nonce || code == NakCode::sequence || code == NakCode::version) {
    const std::lock_guard lock(mutex_);
    linked_ = false;
    if (code == NakCode::nonce) answer.kind = Answer::Kind::restarted;
    return answer;
  }
  if (code != NakCode::none) {
    PayloadReader in(reply->payload);
    in.u16();  // type and code
    answer.kind = Answer::Kind::nak;
    answer.code = code;
    answer.detail = in.i32();
  } else {
    answer.kind = Answer::Kind::ack;
    answer.data.assign(reply->payload.begin() + 1, reply->payload.end());
  }
  return answer;
}

std::optional<SerialLink::Fired> SerialLink::await_done(std::uint32_t shot, std::uint32_t nonce, double patience_s) {
  std::optional<Fired> found;
  std::unique_lock lock(mutex_);
  news_.wait_for(lock, scaled(patience_s), [&] {
    for (const Fired& fired : fired_)
      if (fired.shot == shot) found = fired;
    return found || lost_ || !linked_ || controller_.nonce != nonce;
  });
  if (found && controller_.nonce == nonce) return found;
  check_port();
  return std::nullopt;
}

// ---- listening ----

void SerialLink::listen() {
  using Clock = std::chrono::steady_clock;
  std::array<std::uint8_t, 512> bytes;
  FrameReceiver receiver;
  auto next_beat = Clock::now();
  try {
    while (!ending_) {
      if (const auto now = Clock::now(); now >= next_beat) {
        next_beat = now + scaled(kHeartbeat_s);
        Frame beat;
        beat.type = std::uint8_t(Type::heartbeat);
        beat.nonce = controller().nonce;
        beat.sequence = beat_++;
        if (beat.nonce != 0) send(beat);
      }
      const std::size_t n = port_.read(bytes, next_beat - Clock::now());
      for (std::size_t i = 0; i < n; ++i)
        if (const auto frame = receiver.put(bytes[i])) take(*frame);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    lost_ = std::current_exception();
  }
  news_.notify_all();
}

void SerialLink::take(const Frame& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (frame.version != kVersion && code_of(frame) != NakCode::version) return;
    if (frame.type == std::uint8_t(Type::done)) {
      PayloadReader in(frame.payload);
      Fired fired;
      fired.shot = in.u32();
      fired.state = FiredState(in.u8());
      fired.exposed_ms = in.u32();
      if (!in.ok() || frame.nonce != controller_.nonce) return;
      fired_.push_back(fired);
      if (fired_.size() > kFiredKept) fired_.pop_front();
    } else if (is_reply(frame, Type::heartbeat)) {
      // Either the controller has restarted, or an old copy came late: HELLO will tell.
      if (frame.nonce != controller_.nonce) linked_ = false;
    } else if (asked_ && frame.sequence == asked_->sequence && is_reply(frame, Type(asked_->type))) {
      const NakCode code = code_of(frame);
      if (asked_->type == std::uint8_t(Type::hello)) {
        PayloadReader in(frame.payload);
        in.u8();
        if (code == NakCode::none && in.u32() != session_) return;
      } else if (frame.nonce != asked_->nonce && code != NakCode::nonce) {
        return;
      }
      reply_ = frame;
    } else {
      return;
    }
  }
  news_.notify_all();
}

std::shared_ptr<SerialLink> open_serial_link(const SerialOptions& options) {
  return std::make_shared<SerialLink>(options);
}

}  // namespace lumihull::capture
