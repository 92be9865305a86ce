// Fuzz target: the serial line, from both its ends. What the host's receiver and the firmware's take for a frame is the
// same, and is written again as the bytes it came from; a controller that hears anything keeps within its limits.

#include <serial_frames.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

extern "C" {
#include <fw_controller.h>
}

namespace {

using namespace lumihull::capture::internal;

void require(bool condition) {
  if (!condition) std::abort();
}

struct Machine {
  const std::uint8_t* data;
  std::size_t size, at = 0;
  std::uint32_t now_ms = 0;
  bool shutter = false, solenoid = false;
  fw_controller controller;
};

Machine& of(void* self) { return *static_cast<Machine*>(self); }

/// Bytes of the input; 0xfe lets a tenth of a second pass, which a frame on the line may contain, too.
int read(void* self) {
  Machine& machine = of(self);
  if (machine.at == machine.size) return -1;
  if (machine.data[machine.at] == 0xfe) machine.now_ms += 100;
  return machine.data[machine.at++];
}

void winches(void* self, const std::int32_t* um, std::uint8_t n) {
  const fw_motion& motion = of(self).controller.motion;
  require(motion.position_known && fw_motion_limits_set(&motion));
  for (std::uint8_t i = 0; i < n; ++i) require(um[i] >= motion.limits[i].min_um && um[i] <= motion.limits[i].max_um);
}

void run_controller(const std::uint8_t* data, std::size_t size) {
  Machine machine{data, size, 0, 0, false, false, {}};
  const fw_hal hal{&machine,
                   [](void* self) { return of(self).now_ms; },
                   read,
                   [](void*, std::uint8_t) {},
                   [](void* self, bool on) { of(self).shutter = on; },
                   [](void* self, bool on) { of(self).solenoid = on; },
                   winches,
                   [](void* self) { return of(self).now_ms % 5000 == 4999; }};
  fw_config config{};
  config.winches = 2;
  config.max_exposure_ms = 10000;
  config.max_solenoid_ms = 2000;
  for (auto& limits : config.built_in) limits = {50000, 20000000, 800000, 600000};
  fw_controller_init(&machine.controller, &hal, &config, 0xC0FFEE01);
  while (machine.at < size || machine.now_ms < 100) {
    ++machine.now_ms;
    fw_controller_poll(&machine.controller);
  }
  // With nobody there any more everything ends.
  for (int ms = 0; ms < 6000; ++ms) {
    ++machine.now_ms;
    fw_controller_poll(&machine.controller);
  }
  require(!machine.shutter && !machine.solenoid && machine.controller.motion.path == FW_REST);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FrameReceiver host;
  fw_receiver firmware{};
  std::vector<std::uint8_t> stretch{0};
  for (std::size_t i = 0; i < size; ++i) {
    stretch.push_back(data[i]);
    fw_frame c{};
    const auto frame = host.put(data[i]);
    require(fw_receive(&firmware, data[i], &c) == frame.has_value());
    if (frame) {
      require(c.version == frame->version && c.type == frame->type && c.nonce == frame->nonce &&
              c.sequence == frame->sequence && Bytes(c.payload, c.payload + c.length) == frame->payload);
      require(encode_frame(*frame) == stretch);
      Bytes wire(FW_MAX_WIRE);
      wire.resize(fw_encode(&c, wire.data()));
      require(wire == stretch);
    }
    if (data[i] == 0) stretch = {0};
  }
  if (const auto bytes = cobs_decode({data, size})) require(cobs_decode(cobs_encode(*bytes)) == bytes);
  run_controller(data, size);
  return 0;
}
