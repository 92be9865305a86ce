#include <lumihull/base/parallel.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace lumihull {

void parallel_chunks(Job& job, std::size_t n, std::size_t chunk,
                     const std::function<void(std::size_t, std::size_t)>& body, bool count_progress) {
  assert(chunk > 0);
  const std::size_t chunks = (n + chunk - 1) / chunk;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::exception_ptr failure;
  std::mutex failure_mutex;

  const auto work = [&] {
    while (!stop.load(std::memory_order_relaxed)) {
      const std::size_t c = next.fetch_add(1, std::memory_order_relaxed);
      if (c >= chunks) return;
      try {
        job.check();
        const std::size_t first = c * chunk, last = std::min(n, first + chunk);
        body(first, last);
        if (count_progress) job.advance(last - first);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
        stop.store(true, std::memory_order_relaxed);
      }
    }
  };

  {
    std::vector<std::jthread> helpers;  // joined at the end of this block
    const std::size_t threads = std::min<std::size_t>(job.threads(), chunks);
    try {
      for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back(work);
    } catch (const std::system_error&) {  // no more threads are to be had: those that run do it all
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
  job.check();
}

void parallel_for(Job& job, std::size_t n, const std::function<void(std::size_t)>& body, bool count_progress) {
  parallel_chunks(
      job, n, 1, [&](std::size_t first, std::size_t) { body(first); }, count_progress);
}

}  // namespace lumihull
