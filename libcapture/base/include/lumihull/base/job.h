#pragma once

#include <lumihull/base/api.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace lumihull {

/// How far a long computation is.
struct Progress {
  std::string stage;        ///< what is being done, e.g. "keying"
  std::uint64_t done = 0;   ///< steps done, 0 … total
  std::uint64_t total = 0;  ///< steps in all
  double elapsed_s = 0;     ///< since `begin`
  double eta_s = -1;        ///< seconds to go at the speed so far; negative: not known yet
};

/// Carries progress out of a computation and a wish to stop into it.
///
/// `cancel` may be called from any thread (and from a signal handler: it stores one lock-free flag). The callback runs
/// only on the thread that constructed the Job, at most ten times a second and once at the end of a stage.
/// A Job also says how many threads the computation may use; no result depends on that number.
class LUMIHULL_API Job {
 public:
  using Callback = std::function<void(const Progress&)>;

  /// threads: 0 = one for each core of the machine; more than 1024 count as 1024.
  explicit Job(Callback callback = {}, unsigned threads = 0);
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
  /// Throws Error{cancelled} after `cancel`. Cheap: call it once for each chunk of work.
  void check() const;

  /// Starts a stage of `total` steps. Owner's thread only.
  void begin(std::string stage, std::uint64_t total);
  /// Counts steps as done; any thread.
  void advance(std::uint64_t steps = 1);
  /// Ends the stage: reports done = total. Owner's thread only.
  void end();

  unsigned threads() const noexcept { return threads_; }

 private:
  void report();

  Callback callback_;
  unsigned threads_;
  std::thread::id owner_;
  std::atomic<bool> cancelled_{false};
  std::atomic<std::uint64_t> done_{0};
  std::uint64_t total_ = 0;
  std::string stage_;
  std::chrono::steady_clock::time_point start_{}, last_{};
};

}  // namespace lumihull
