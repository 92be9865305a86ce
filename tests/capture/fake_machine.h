#pragma once

// The firmware with hardware made of variables: its time stands until a test lets it pass.

extern "C" {
#include <fw_controller.h>
}

#include <serial_frames.h>
#include <serial_messages.h>

#include <cstdint>
#include <deque>
#include <vector>

namespace lumihull::test {

class FakeMachine {
 public:
  using Bytes = capture::internal::Bytes;
  using Frame = capture::internal::Frame;

  explicit FakeMachine(std::uint8_t winches = 2, std::uint32_t nonce = 0xC0FFEE01, std::uint32_t time_ms = 0)
      : now_ms(time_ms) {
    config.winches = winches;
    config.max_exposure_ms = 10000;
    config.max_solenoid_ms = 2000;
    for (auto& limits : config.built_in) limits = {50000, 20000000, 800000, 600000};
    hal = {this, time, read, write, shutter_to, solenoid_to, winches_to, stop_pressed};
    fw_controller_init(&controller, &hal, &config, nonce);
  }
  FakeMachine(const FakeMachine&) = delete;
  FakeMachine& operator=(const FakeMachine&) = delete;

  /// A millisecond at a time, as in a controller.
  void pass(std::uint32_t ms) {
    for (std::uint32_t i = 0; i < ms; ++i) {
      ++now_ms;
      fw_controller_poll(&controller);
    }
  }
  void hear(const Bytes& wire) {
    incoming.insert(incoming.end(), wire.begin(), wire.end());
    while (!incoming.empty()) fw_controller_poll(&controller);
  }
  /// All frames that it has sent since the last call.
  std::vector<Frame> said() {
    std::vector<Frame> frames;
    capture::internal::FrameReceiver receiver;
    for (const std::uint8_t byte : sent)
      if (auto frame = receiver.put(byte)) frames.push_back(*frame);
    sent.clear();
    return frames;
  }
  /// Says one request of the next number and returns the reply; a frame with version 0 where there is none.
  Frame ask(capture::internal::Type type, const Bytes& payload = {}) {
    Frame frame;
    frame.type = std::uint8_t(type);
    frame.nonce = type == capture::internal::Type::hello ? 0 : controller.nonce;
    frame.sequence = ++sequence;
    frame.payload = payload;
    said();
    hear(capture::internal::encode_frame(frame));
    const auto frames = said();
    for (const Frame& reply : frames)
      if (reply.sequence == sequence && reply.type != std::uint8_t(capture::internal::Type::done)) return reply;
    Frame none;
    none.version = 0;
    return none;
  }

  std::uint32_t now_ms;
  std::uint16_t sequence = 0xfff0;  ///< near its end, so that it wraps
  std::deque<std::uint8_t> incoming;
  Bytes sent;
  bool shutter = false, solenoid = false, stop = false;
  std::uint32_t shutter_times = 0;                 ///< how often it was closed
  std::vector<std::vector<std::int32_t>> lengths;  ///< at each step of the winches
  fw_hal hal;
  fw_config config{};
  fw_controller controller;

 private:
  static FakeMachine& of(void* self) { return *static_cast<FakeMachine*>(self); }
  static std::uint32_t time(void* self) { return of(self).now_ms; }
  static int read(void* self) {
    auto& bytes = of(self).incoming;
    if (bytes.empty()) return -1;
    const int byte = bytes.front();
    bytes.pop_front();
    return byte;
  }
  static void write(void* self, std::uint8_t byte) { of(self).sent.push_back(byte); }
  static void shutter_to(void* self, bool closed) {
    of(self).shutter = closed;
    of(self).shutter_times += closed;
  }
  static void solenoid_to(void* self, bool on) { of(self).solenoid = on; }
  static void winches_to(void* self, const std::int32_t* um, std::uint8_t n) {
    of(self).lengths.emplace_back(um, um + n);
  }
  static bool stop_pressed(void* self) { return of(self).stop; }
};

}  // namespace lumihull::test
