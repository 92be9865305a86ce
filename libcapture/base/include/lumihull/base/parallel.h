#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <cstddef>
#include <functional>

namespace lumihull {

/// Calls body(first, last) for consecutive chunks of [0, n), each of `chunk` items (the last may be shorter), on up to
/// job.threads() threads, the caller's among them. Chunks are fixed by n and chunk alone, so that a result which each
/// chunk writes to its own place does not depend on the number of threads.
///
/// The first exception (by time) stops the loop and is thrown again on the caller's thread; so does `job.cancel()`.
/// With count_progress each finished item advances the job by one.
/// May be nested: an inner loop then starts threads of its own, so give inner loops a Job of one thread.
LUMIHULL_API void parallel_chunks(Job& job, std::size_t n, std::size_t chunk,
                                  const std::function<void(std::size_t first, std::size_t last)>& body,
                                  bool count_progress = false);

/// The same, item by item: body(i) with i in [0, n), chunk = 1.
LUMIHULL_API void parallel_for(Job& job, std::size_t n, const std::function<void(std::size_t)>& body,
                               bool count_progress = false);

}  // namespace lumihull
