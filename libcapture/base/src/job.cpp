#include <lumihull/base/error.h>
#include <lumihull/base/job.h>

#include <algorithm>
#include <utility>

namespace lumihull {

namespace {
constexpr std::chrono::milliseconds kReportInterval{100};
constexpr unsigned kMostThreads = 1024;
}  // namespace

Job::Job(Callback callback, unsigned threads)
    : callback_(std::move(callback)),
      threads_(std::min(threads ? threads : std::max(1u, std::thread::hardware_concurrency()), kMostThreads)),
      owner_(std::this_thread::get_id()) {}

void Job::check() const {
  if (cancelled()) throw Error(ErrorCode::cancelled, "stopped on request");
}

void Job::begin(std::string stage, std::uint64_t total) {
  check();
  stage_ = std::move(stage);
  total_ = total;
  done_.store(0, std::memory_order_relaxed);
  start_ = last_ = std::chrono::steady_clock::now();
  report();
}

void Job::advance(std::uint64_t steps) {
  done_.fetch_add(steps, std::memory_order_relaxed);
  if (!callback_ || std::this_thread::get_id() != owner_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kReportInterval) return;
  last_ = now;
  report();
}

void Job::end() {
  done_.store(total_, std::memory_order_relaxed);
  report();
}

void Job::report() {
  if (!callback_) return;
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const std::uint64_t done = std::min(done_.load(std::memory_order_relaxed), total_);
  const double eta = done == 0 ? -1 : elapsed * double(total_ - done) / double(done);
  callback_({stage_, done, total_, elapsed, eta});
}

}  // namespace lumihull
