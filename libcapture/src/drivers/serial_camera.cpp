// The camera's shutter over the serial link: each shot number at most once (PROTOCOL.md, section 5, FIRE).
#include <lumihull/base/error.h>
#include <lumihull/capture/serial.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "serial_link.h"

namespace lumihull::capture {
namespace {

using namespace internal;
using Kind = SerialLink::Answer::Kind;

constexpr double kDoneLate_s = 0.5;  ///< DONE comes this long after the exposure, or is lost
constexpr double kPoll_s = 0.1;
constexpr int kQuestions = 4;  ///< about a shot, without a reply

class SerialCamera final : public CameraDevice {
 public:
  explicit SerialCamera(std::shared_ptr<SerialLink> link) : link_(std::move(link)) {}
  ~SerialCamera() override { make_safe(); }

  bool delivers_files() const override { return false; }
  ShotOutcome shoot(ShotId id, double exposure_s, const std::filesystem::path& folder, Job& job) override;
  ShotOutcome recall(ShotId id) override;
  void make_safe() noexcept override;

 private:
  struct Attempt {
    std::uint32_t nonce = 0;  ///< of the controller's start that was told to fire
    ShotOutcome outcome;      ///< unknown until it is clear
  };
  ShotOutcome fire(ShotId id, double exposure_s);
  ShotOutcome inquire(ShotId id, std::uint32_t nonce, double exposure_s);

  std::shared_ptr<SerialLink> link_;
  std::map<ShotId, Attempt> attempts_;  ///< all but those that were surely refused
};

ShotOutcome outcome_of(const SerialLink::Fired& fired) {
  switch (fired.state) {
    case FiredState::done:
      return {ShotState::done, {}, {}};
    case FiredState::cut:
      return {ShotState::unknown, {}, "exposed, but cut short after " + std::to_string(fired.exposed_ms) + " ms"};
    case FiredState::none:
      return {ShotState::refused, {}, "the command did not reach the controller"};
    case FiredState::forgotten:
      return {ShotState::unknown, {}, "the controller remembers only later shots"};
    case FiredState::exposing:
      return {ShotState::unknown, {}, "is still being exposed"};
  }
  return {ShotState::unknown, {}, "the controller's reply is not as in the protocol"};
}

SerialLink::Fired read_fired(const Bytes& data) {
  PayloadReader in(data);
  SerialLink::Fired fired;
  fired.shot = in.u32();
  fired.state = FiredState(in.u8());
  fired.exposed_ms = in.u32();
  if (!in.ok()) fired.state = FiredState::forgotten;
  return fired;
}

/// Asks what became of a shot of which no more is known than that it may have been fired under `nonce`.
ShotOutcome SerialCamera::inquire(ShotId id, std::uint32_t nonce, double exposure_s) {
  Bytes payload;
  append_u32(payload, id);
  ShotOutcome outcome{ShotState::unknown, {}, "the controller does not answer"};
  int unanswered = 0;
  for (double waited_s = 0; waited_s < exposure_s + 2 && unanswered < kQuestions;) {
    const auto answer = link_->request(Type::shot_status, payload);
    if (answer.nonce != 0 && answer.nonce != nonce)
      return {ShotState::unknown, {}, "the controller restarted in between"};
    if (answer.kind != Kind::ack) {
      ++unanswered;
      continue;
    }
    const SerialLink::Fired fired = read_fired(answer.data);
    outcome = outcome_of(fired);
    if (fired.state != FiredState::exposing) return outcome;
    link_->sleep(kPoll_s);
    waited_s += kPoll_s;
  }
  return outcome;
}

ShotOutcome SerialCamera::fire(ShotId id, double exposure_s) {
  Bytes payload;
  append_u32(payload, id);
  append_u32(payload, std::uint32_t(std::max(1LL, std::llround(exposure_s * 1e3))));
  try {
    link_->check();
  } catch (const Error& e) {
    return {ShotState::refused, {}, e.what()};  // nothing was said: a refusal leaves no doubt
  }
  Attempt& attempt = attempts_[id];
  attempt.outcome = {
      ShotState::unknown, {}, "the serial port was lost meanwhile"};  // stays, where the next line throws
  const auto answer = link_->request(Type::fire, payload);
  attempt.nonce = answer.nonce;
  if (answer.nonce == 0) return {ShotState::refused, {}, "the controller does not answer; nothing was sent but HELLO"};
  switch (answer.kind) {
    case Kind::restarted:
      return {ShotState::unknown, {}, "the controller restarted in between"};
    case Kind::nak:
      if (answer.code == NakCode::shot_known) return inquire(id, answer.nonce, exposure_s);
      return {ShotState::refused, {}, nak_words(answer.code)};
    case Kind::silent:
      return inquire(id, answer.nonce, exposure_s);
    case Kind::ack:
      break;
  }
  const auto fired = link_->await_done(id, answer.nonce, exposure_s + kDoneLate_s);
  return fired ? outcome_of(*fired) : inquire(id, answer.nonce, exposure_s);
}

ShotOutcome SerialCamera::shoot(ShotId id, double exposure_s, const std::filesystem::path&, Job& job) {
  if (!(exposure_s > 0 && exposure_s <= 3600))
    throw Error(ErrorCode::invalid_argument, "must be above 0 and at most an hour", "exposure_s");
  job.check();
  if (const auto earlier = attempts_.find(id); earlier != attempts_.end()) {
    ShotOutcome outcome = earlier->second.outcome;
    if (outcome.state == ShotState::unknown) outcome = recall(id);
    if (outcome.state != ShotState::refused) {
      outcome.detail = "was fired before" + (outcome.detail.empty() ? "" : ": " + outcome.detail);
      return outcome;
    }
  }
  const ShotOutcome outcome = fire(id, exposure_s);
  if (outcome.state == ShotState::refused)
    attempts_.erase(id);
  else
    attempts_[id].outcome = outcome;
  return outcome;
}

ShotOutcome SerialCamera::recall(ShotId id) {
  const auto attempt = attempts_.find(id);
  if (attempt != attempts_.end()) {
    ShotOutcome& outcome = attempt->second.outcome;
    if (outcome.state == ShotState::unknown && attempt->second.nonce != 0)
      outcome = inquire(id, attempt->second.nonce, 0);
    return outcome;
  }
  // Fired by a process before this one, perhaps. That the controller has not seen it since its start proves nothing.
  const std::uint32_t nonce = link_->controller().nonce;
  ShotOutcome outcome = inquire(id, nonce, 0);
  if (outcome.state == ShotState::refused)
    outcome = {ShotState::unknown, {}, "the controller has not fired it since it started"};
  return outcome;
}

void SerialCamera::make_safe() noexcept {
  try {
    link_->request(Type::stop, {stop_what::exposure});
  } catch (...) {
    // The port is gone: the controller hears no heartbeat and does it by itself.
  }
}

}  // namespace

std::unique_ptr<CameraDevice> open_serial_camera(std::shared_ptr<SerialLink> link) {
  return std::make_unique<SerialCamera>(std::move(link));
}

}  // namespace lumihull::capture
