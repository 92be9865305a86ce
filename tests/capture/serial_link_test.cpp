// The host against the firmware on a pseudo-terminal, over a bad line. Times are the simulator's own.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lumihull/base/error.h>
#include <lumihull/capture/serial.h>
#include <serial_frames.h>
#include <serial_messages.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "serial_simulator.h"

namespace lumihull::test {
namespace {

using namespace capture;
using testing::HasSubstr;

// How many times as fast as the clock. Where an exposure is longer than the 1.5 s after which the controller gives the
// host up, slower: the host must be heard in time on a busy machine.
constexpr double kSpeed = 40, kSlowSpeed = 10;
const std::vector<std::string> kFast{"--speed", "40"}, kSlow{"--speed", "10"};

SerialOptions fast(const SerialSimulator& simulator) {
  SerialOptions options;
  options.device = simulator.device();
  options.time_scale = kSpeed;
  return options;
}

SerialOptions slow(const SerialSimulator& simulator) {
  SerialOptions options = fast(simulator);
  options.time_scale = kSlowSpeed;
  return options;
}

template <class Call>
std::string error_of(Call call, ErrorCode code) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

struct Tally {
  int done = 0, refused = 0, unknown = 0;
};

/// Fires shots 1 … n; each outcome is compared with what really happened.
Tally fire(const std::vector<std::string>& faults, std::uint32_t shots, std::uint32_t seed) {
  std::vector<std::string> words = kFast;
  words.insert(words.end(), {"--seed", std::to_string(seed)});
  words.insert(words.end(), faults.begin(), faults.end());
  std::vector<ShotState> outcomes(shots + 1);
  std::vector<std::uint32_t> exposures_ms(shots + 1);
  std::vector<SimulatedEvent> log;
  std::mt19937 random(seed);
  {
    const SerialSimulator simulator(words);
    std::unique_ptr<CameraDevice> camera;
    for (int i = 0; !camera; ++i) try {
        camera = open_serial_camera(open_serial_link(fast(simulator)));
      } catch (const Error&) {  // the line is bad from the beginning
        if (i > 20) throw;
      }
    Job job;
    for (std::uint32_t shot = 1; shot <= shots; ++shot) {
      exposures_ms[shot] = 5 + random() % 40;
      outcomes[shot] = camera->shoot(shot, exposures_ms[shot] * 1e-3, {}, job).state;
      // A retry after a refusal has the same number.
      if (outcomes[shot] == ShotState::refused)
        outcomes[shot] = camera->shoot(shot, exposures_ms[shot] * 1e-3, {}, job).state;
      // Whatever the outcome, asking again does not fire; refused ones may.
      if (outcomes[shot] != ShotState::refused && random() % 8 == 0) {
        const ShotState again = camera->shoot(shot, exposures_ms[shot] * 1e-3, {}, job).state;
        EXPECT_TRUE(outcomes[shot] == again || outcomes[shot] == ShotState::unknown);
      }
    }
    camera.reset();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what is late on the line would fire now
    log = simulator.log();
  }
  Tally tally;
  const auto truth = true_shots(log, shots + 1);
  for (std::uint32_t shot = 1; shot <= shots; ++shot) {
    SCOPED_TRACE("shot " + std::to_string(shot));
    EXPECT_LE(truth[shot].begun, 1u) << "exposed twice";
    switch (outcomes[shot]) {
      case ShotState::done:
        ++tally.done;
        EXPECT_EQ(truth[shot].begun, 1u);
        EXPECT_TRUE(truth[shot].whole);
        EXPECT_EQ(truth[shot].ms, exposures_ms[shot]);
        break;
      case ShotState::refused:
        ++tally.refused;
        EXPECT_EQ(truth[shot].begun, 0u);
        break;
      case ShotState::unknown:
        ++tally.unknown;
    }
  }
  std::printf("    %u shots: %d done, %d refused, %d unknown\n", shots, tally.done, tally.refused, tally.unknown);
  return tally;
}

TEST(SerialCamera, OnAGoodLineEachShotIsDone) {
  const Tally tally = fire({}, 300, 1);
  EXPECT_GE(tally.done, 290);  // a machine that stands still for a while may cost a heartbeat
}

TEST(SerialCamera, TenThousandShotsOverABadLineAndNoneTwice) {
  const Tally tally = fire({"--drop", "0.05", "--damage", "0.05", "--duplicate", "0.05", "--delay", "0.05", "--garbage",
                            "0.02", "--reboot", "0.005"},
                           10000, 2);
  EXPECT_EQ(tally.done + tally.refused + tally.unknown, 10000);
  EXPECT_GE(tally.done, 5000);   // else the test would show little
  EXPECT_GE(tally.unknown, 20);  // reboots in the middle of exposures
}

TEST(SerialCamera, ALineThatLosesHalfOfItsFrames) {
  const Tally tally =
      fire({"--drop", "0.3", "--damage", "0.2", "--duplicate", "0.3", "--delay", "0.3", "--reboot", "0.02"}, 300, 3);
  EXPECT_GE(tally.done, 20);
}

TEST(SerialCamera, TellsWhatBecameOfAShot) {
  const SerialSimulator simulator(kFast);
  auto link = open_serial_link(fast(simulator));
  auto camera = open_serial_camera(link);
  EXPECT_FALSE(camera->delivers_files());
  Job job;
  EXPECT_EQ(camera->shoot(4, 0.05, {}, job).state, ShotState::done);
  EXPECT_EQ(camera->recall(4).state, ShotState::done);
  // Another process later, which knows nothing but the number.
  EXPECT_EQ(open_serial_camera(link)->recall(4).state, ShotState::done);
  EXPECT_EQ(open_serial_camera(link)->recall(5).state, ShotState::unknown);
  EXPECT_EQ(open_serial_camera(link)->shoot(4, 0.05, {}, job).state, ShotState::done);  // not fired again
  // Beyond the limit: surely none; then the same number within it.
  const auto refused = camera->shoot(6, 11, {}, job);
  EXPECT_EQ(refused.state, ShotState::refused);
  EXPECT_THAT(refused.detail, HasSubstr("limit"));
  EXPECT_EQ(camera->shoot(6, 0.05, {}, job).state, ShotState::done);
  error_of([&] { camera->shoot(7, NAN, {}, job); }, ErrorCode::invalid_argument);
  job.cancel();
  error_of([&] { camera->shoot(7, 0.05, {}, job); }, ErrorCode::cancelled);
  const auto truth = true_shots(simulator.log(), 8);
  EXPECT_EQ(truth[4].begun + truth[6].begun, 2u);
  EXPECT_EQ(truth[5].begun + truth[7].begun, 0u);
}

TEST(SerialCamera, ARestartInTheMiddleOfAnExposureIsUnknownAndStaysSo) {
  const SerialSimulator simulator(kSlow);
  auto camera = open_serial_camera(open_serial_link(slow(simulator)));
  Job job;
  std::thread power([&] {
    simulator.await("shutter on 1");
    simulator.order("reset");
  });
  const auto outcome = camera->shoot(1, 10, {}, job);  // ten of the simulator's seconds
  power.join();
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_THAT(outcome.detail, HasSubstr("restarted"));
  simulator.await("boot 2");
  EXPECT_EQ(camera->recall(1).state, ShotState::unknown);
  EXPECT_EQ(camera->shoot(1, 0.05, {}, job).state, ShotState::unknown);
  EXPECT_EQ(camera->shoot(2, 0.05, {}, job).state, ShotState::done);
  EXPECT_EQ(true_shots(simulator.log(), 3)[1].begun, 1u);
}

TEST(SerialCamera, MakingSafeCutsTheExposure) {
  const SerialSimulator simulator(kSlow);
  auto link = open_serial_link(slow(simulator));
  auto camera = open_serial_camera(link);
  std::thread other([&] {
    simulator.await("shutter on 1");
    open_serial_camera(link)->make_safe();
  });
  Job job;
  const auto outcome = camera->shoot(1, 10, {}, job);
  other.join();
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_THAT(outcome.detail, HasSubstr("cut short"));
}

TEST(SerialLink, WhenTheLineIsCutTheOutputsAreSafeWithinThreeHeartbeats) {
  const SerialSimulator simulator(kSlow);
  auto camera = open_serial_camera(open_serial_link(slow(simulator)));
  std::thread line([&] {
    simulator.await("shutter on 1");
    simulator.order("deaf on");
  });
  Job job;
  const auto outcome = camera->shoot(1, 9, {}, job);
  line.join();
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_THAT(outcome.detail, HasSubstr("does not answer"));
  const auto cut = simulator.await("deaf on"), safe = simulator.await("shutter off", cut);
  const auto log = simulator.log();
  EXPECT_LE(log[safe].ms - log[cut].ms, 1600u);
  simulator.order("deaf off");
  simulator.await("deaf off");
  const auto later = camera->recall(1);
  EXPECT_EQ(later.state, ShotState::unknown);
  EXPECT_THAT(later.detail, HasSubstr("cut short"));
}

TEST(SerialLink, APortThatIsPulledOutIsAnErrorThatNamesIt) {
  SerialSimulator simulator(kFast);
  auto link = open_serial_link(fast(simulator));
  auto camera = open_serial_camera(link);
  simulator.kill();
  Job job;
  ShotOutcome outcome;
  for (int i = 1; i < 1000 && outcome.state != ShotState::refused; ++i) try {
      outcome = camera->shoot(ShotId(i), 0.01, {}, job);
    } catch (const Error& e) {  // before the link has heard of it
      EXPECT_EQ(e.code(), ErrorCode::io);
      EXPECT_THAT(e.what(), HasSubstr(simulator.device()));
      EXPECT_EQ(camera->recall(ShotId(i)).state, ShotState::unknown);  // it may have been fired
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  EXPECT_EQ(outcome.state, ShotState::refused);  // nothing was said any more
  EXPECT_THAT(outcome.detail, HasSubstr(simulator.device()));
  EXPECT_THAT(outcome.detail, HasSubstr("plug the controller in again"));
  camera->make_safe();  // says nothing
  error_of([&] { camera->recall(99); }, ErrorCode::io);
}

TEST(SerialLink, PortsThatCanNotBeOpenedAreNamedWithWhatToDo) {
  SerialOptions options;
  error_of([&] { open_serial_link(options); }, ErrorCode::invalid_argument);
  options.device = "/dev/does_not_exist";
  EXPECT_THAT(error_of([&] { open_serial_link(options); }, ErrorCode::not_found), HasSubstr("plug"));
  options.device = "/dev/null";
  EXPECT_THAT(error_of([&] { open_serial_link(options); }, ErrorCode::io), HasSubstr("no serial port"));
  options.baud = 12345;
  error_of([&] { open_serial_link(options); }, ErrorCode::invalid_argument);
  const SerialSimulator simulator(kFast);
  options = fast(simulator);
  options.time_scale = 0.5;
  error_of([&] { open_serial_link(options); }, ErrorCode::invalid_argument);
}

TEST(SerialLink, ThePortIsOursAlone) {
  const SerialSimulator simulator(kFast);
  {
    auto link = open_serial_link(fast(simulator));
    EXPECT_THAT(error_of([&] { open_serial_link(fast(simulator)); }, ErrorCode::io), HasSubstr("in use"));
    // A program that knows nothing of our lock, and is not root.
    const pid_t child = fork();
    if (child == 0) {
      if (setuid(65534) != 0) _exit(2);
      _exit(open(simulator.device().c_str(), O_RDWR | O_NOCTTY) < 0 ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (geteuid() == 0) {
      EXPECT_EQ(WEXITSTATUS(status), 0);
    }
    Job job;
    EXPECT_EQ(open_serial_camera(link)->shoot(1, 0.01, {}, job).state, ShotState::done);
  }
  open_serial_link(fast(simulator));  // free again
}

/// A terminal on which nobody speaks the protocol: silent, or noise.
class Terminal {
 public:
  Terminal() : master(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) throw std::runtime_error("pseudo-terminal");
    device = ptsname(master);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() { close(master); }
  int master;
  std::string device;
};

TEST(SerialLink, SilenceAndNoiseAreNoController) {
  for (const bool noise : {false, true}) {
    const Terminal terminal;
    std::atomic<bool> over = false;
    std::thread flood([&] {
      std::mt19937 random(7);
      std::array<std::uint8_t, 4096> bytes;
      fcntl(terminal.master, F_SETFL, O_NONBLOCK);
      while (!over) {
        for (auto& byte : bytes) byte = std::uint8_t(random());
        if (!noise || write(terminal.master, bytes.data(), bytes.size()) < 0)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        while (read(terminal.master, bytes.data(), bytes.size()) > 0) {
        }
      }
    });
    SerialOptions options;
    options.device = terminal.device;
    options.time_scale = 50;
    EXPECT_THAT(error_of([&] { open_serial_link(options); }, ErrorCode::io), HasSubstr("no controller answers"));
    over = true;
    flood.join();
  }
}

TEST(SerialLink, AControllerOfAnotherVersionIsNamed) {
  const Terminal terminal;
  std::atomic<bool> over = false;
  std::thread later_version([&] {
    internal::FrameReceiver receiver;
    std::array<std::uint8_t, 256> bytes;
    fcntl(terminal.master, F_SETFL, O_NONBLOCK);
    while (!over) {
      const ssize_t n = read(terminal.master, bytes.data(), bytes.size());
      if (n <= 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      for (ssize_t i = 0; i < n; ++i)
        if (auto frame = receiver.put(bytes[std::size_t(i)])) {
          frame->version = 7;
          frame->type = std::uint8_t(internal::Type::nak);
          frame->payload = {std::uint8_t(internal::Type::hello), std::uint8_t(internal::NakCode::version), 7, 0, 0, 0};
          const auto wire = internal::encode_frame(*frame);
          if (write(terminal.master, wire.data(), wire.size()) < 0) return;
        }
    }
  });
  SerialOptions options;
  options.device = terminal.device;
  options.time_scale = 10;
  EXPECT_THAT(error_of([&] { open_serial_link(options); }, ErrorCode::io), HasSubstr("version 7"));
  over = true;
  later_version.join();
}

TEST(SerialLink, ALineThatEchoesIsNoController) {
  const Terminal terminal;
  std::atomic<bool> over = false;
  std::thread echo([&] {
    std::array<std::uint8_t, 4096> bytes;
    fcntl(terminal.master, F_SETFL, O_NONBLOCK);
    while (!over) {
      const ssize_t n = read(terminal.master, bytes.data(), bytes.size());
      if (n <= 0 || write(terminal.master, bytes.data(), std::size_t(n)) < 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  SerialOptions options;
  options.device = terminal.device;
  options.time_scale = 50;
  EXPECT_THAT(error_of([&] { open_serial_link(options); }, ErrorCode::io), HasSubstr("no controller answers"));
  over = true;
  echo.join();
}

}  // namespace
}  // namespace lumihull::test
