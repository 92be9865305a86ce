#pragma once

// Numbers of libcapture/firmware/PROTOCOL.md, sections 3 to 5.

#include <cstdint>

namespace lumihull::capture::internal {

enum class Type : std::uint8_t {
  hello = 0x01,
  heartbeat = 0x02,
  status = 0x03,
  shot_status = 0x04,
  fire = 0x10,
  solenoid = 0x11,
  limits = 0x20,
  declare = 0x21,
  move = 0x22,
  setpoint = 0x23,
  start = 0x24,
  stop = 0x25,
  ack = 0x80,
  nak = 0x81,
  done = 0x82,
};

enum class NakCode : std::uint8_t {
  none = 0,
  version = 1,
  nonce = 2,
  sequence = 3,
  type = 4,
  payload = 5,
  limit = 6,
  busy = 7,
  stopped = 8,
  position = 9,
  no_limits = 10,
  shot_known = 11,
  queue = 12,
  shot_old = 13,
};

namespace flag {
constexpr unsigned moving = 1 << 0, position_known = 1 << 1, emergency_stop = 1 << 2, exposing = 1 << 3,
                   solenoid = 1 << 4, host_lost = 1 << 5, limits_set = 1 << 6, broken_off = 1 << 7;
}

namespace stop_what {
constexpr std::uint8_t moves = 1, solenoid = 2, exposure = 4;
}

enum class FiredState : std::uint8_t { none = 0, exposing = 1, done = 2, cut = 3, forgotten = 4 };

}  // namespace lumihull::capture::internal
