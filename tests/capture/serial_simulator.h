#pragma once

// The firmware's simulator as a child process, and the truth that it writes down.

#include <lumihull/capture/plan.h>
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "support.h"

namespace lumihull::test {

/// One event of the log.
struct SimulatedEvent {
  std::uint64_t ms = 0;  ///< simulated
  std::string what;      ///< e.g. "shutter on 17"
};

class SerialSimulator {
 public:
  /// Options beyond --log; see the program's source.
  explicit SerialSimulator(const std::vector<std::string>& options);
  SerialSimulator(const SerialSimulator&) = delete;
  SerialSimulator& operator=(const SerialSimulator&) = delete;
  ~SerialSimulator();

  const std::string& device() const { return device_; }
  void order(const std::string& line) const;  ///< "reset", "stop on", "deaf on", …
  void kill();                                ///< as if it had been unplugged
  std::vector<SimulatedEvent> log() const;
  /// Waits for an event that begins so, among those from number `from` on; its index. Fails the test after 60 s.
  std::size_t await(const std::string& what, std::size_t from = 0) const;

 private:
  TemporaryFolder folder_;
  std::string device_;
  pid_t child_ = 0;
  int orders_ = -1;
};

/// What really happened to one shot.
struct TrueShot {
  unsigned begun = 0;    ///< how often its exposure began
  bool whole = false;    ///< and ended by itself
  std::uint64_t ms = 0;  ///< how long the last one was
};
/// Index = shot number.
std::vector<TrueShot> true_shots(const std::vector<SimulatedEvent>& log, std::size_t count);

/// Six photographs a hand's breadth apart, so that winches are quick: of the paper's mechanism.
capture::Plan short_hops();

}  // namespace lumihull::test
