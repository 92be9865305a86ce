#pragma once

#include <lumihull.h>
#include <lumihull/base/error.h>
#include <lumihull/base/job.h>

#include <atomic>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

/// Fixed buffers: storing an error must not need memory, which may be what ran out.
struct lh_context {
  lh_status status = LH_OK;
  char message[1024] = "";
  char subject[1024] = "";
  lh_progress_fn progress = nullptr;
  void* user = nullptr;
  unsigned threads = 0;

  std::atomic<bool> busy{false};
  std::atomic<bool> cancelled{false};
  std::atomic<lumihull::Job*> job{nullptr};  ///< of the running call
  std::atomic<int> cancellers{0};            ///< threads that may be using `job` just now
};

namespace lumihull::capi {

/// The job of one call. `lh_context_cancel` must work from a signal handler, so no mutex protects ctx.job: the call
/// takes the pointer away and then waits for those who may have seen it.
class CallJob {
 public:
  explicit CallJob(lh_context& ctx);
  CallJob(const CallJob&) = delete;
  CallJob& operator=(const CallJob&) = delete;
  ~CallJob();
  Job& operator*() { return job_; }

 private:
  lh_context& ctx_;
  Job job_;
};

lh_status store_error(lh_context& ctx, ErrorCode code, std::string_view message, std::string_view subject) noexcept;

/// The one guard: runs the body of an API call, and turns everything that it throws into a status.
/// body is callable as body() or, for calls with progress and cancel, body(Job&).
template <class Body>
lh_status guarded(lh_context* ctx, Body&& body) noexcept {
  if (!ctx || ctx->busy.exchange(true)) return LH_EINVAL;
  ctx->status = LH_OK;
  ctx->message[0] = ctx->subject[0] = '\0';
  lh_status status = LH_OK;
  try {
    if constexpr (std::is_invocable_v<Body, Job&>) {
      CallJob job(*ctx);
      (*job).check();
      body(*job);
    } else {
      body();
    }
  } catch (const Error& e) {
    status = store_error(*ctx, e.code(), e.message(), e.subject());
  } catch (const std::bad_alloc&) {
    status = store_error(*ctx, ErrorCode::out_of_memory, "out of memory", "");
  } catch (const std::filesystem::filesystem_error& e) {
    status = store_error(*ctx, ErrorCode::io, e.code().message(), e.path1().native());
  } catch (const std::exception& e) {
    status = store_error(*ctx, ErrorCode::internal, e.what(), "");
  } catch (...) {
    status = store_error(*ctx, ErrorCode::internal, "an unknown exception", "");
  }
  ctx->busy.store(false);
  return status;
}

}  // namespace lumihull::capi
