#include "context.h"

#include <cstring>

#ifndef LUMIHULL_VERSION
#error "the build defines LUMIHULL_VERSION"
#endif

namespace lumihull::capi {

namespace {

constexpr unsigned kMaxThreads = 1024;

/// Copies as much as fits; the cut never splits a UTF-8 character, and a line break becomes a space.
template <std::size_t N>
void copy_text(char (&to)[N], std::string_view from) noexcept {
  std::size_t n = std::min(from.size(), N - 1);
  if (n < from.size())
    while (n > 0 && (static_cast<unsigned char>(from[n]) & 0xC0) == 0x80) --n;
  for (std::size_t i = 0; i < n; ++i) to[i] = from[i] == '\n' || from[i] == '\r' ? ' ' : from[i];
  to[n] = '\0';
}

Job::Callback progress_callback(const lh_context& ctx) {
  if (!ctx.progress) return {};
  return [fn = ctx.progress, user = ctx.user](const Progress& p) {
    const lh_progress progress{sizeof(lh_progress), p.stage.c_str(), p.done, p.total, p.elapsed_s, p.eta_s};
    fn(user, &progress);
  };
}

}  // namespace

CallJob::CallJob(lh_context& ctx) : ctx_(ctx), job_(progress_callback(ctx), ctx.threads) {
  ctx_.job.store(&job_);
  if (ctx_.cancelled.load()) job_.cancel();
}

CallJob::~CallJob() {
  ctx_.job.store(nullptr);
  while (ctx_.cancellers.load() > 0) std::this_thread::yield();
}

lh_status store_error(lh_context& ctx, ErrorCode code, std::string_view message, std::string_view subject) noexcept {
  copy_text(ctx.message, message);
  copy_text(ctx.subject, subject);
  ctx.status = -static_cast<lh_status>(code);
  return ctx.status;
}

}  // namespace lumihull::capi

using lumihull::capi::guarded;

const char* lh_status_text(lh_status status) {
  switch (status) {
    case LH_OK:
      return "done";
    case LH_EINVAL:
      return "invalid argument";
    case LH_EINPUT:
      return "bad input";
    case LH_ENOTFOUND:
      return "not found";
    case LH_EIO:
      return "read or write error";
    case LH_EUNSUPPORTED:
      return "unsupported";
    case LH_EDEGENERATE:
      return "degenerate geometry";
    case LH_ENOMEM:
      return "out of memory";
    case LH_ECANCELLED:
      return "cancelled";
    case LH_EINTERNAL:
      return "internal error";
    default:
      return "unknown status";
  }
}

const char* lh_version(void) { return LUMIHULL_VERSION; }

lh_context* lh_context_create(void) { return new (std::nothrow) lh_context; }

void lh_context_destroy(lh_context* ctx) { delete ctx; }

lh_status lh_context_set_progress(lh_context* ctx, lh_progress_fn fn, void* user) {
  return guarded(ctx, [&] {
    ctx->progress = fn;
    ctx->user = user;
  });
}

lh_status lh_context_set_threads(lh_context* ctx, uint32_t threads) {
  return guarded(ctx, [&] {
    if (threads > lumihull::capi::kMaxThreads)
      throw lumihull::Error(lumihull::ErrorCode::invalid_argument,
                            "expected at most 1024, found " + std::to_string(threads), "threads");
    ctx->threads = threads;
  });
}

void lh_context_cancel(lh_context* ctx) {
  if (!ctx) return;
  ctx->cancelled.store(true);
  ctx->cancellers.fetch_add(1);
  if (lumihull::Job* job = ctx->job.load()) job->cancel();
  ctx->cancellers.fetch_sub(1);
}

void lh_context_clear_cancel(lh_context* ctx) {
  if (ctx) ctx->cancelled.store(false);
}

int32_t lh_context_cancelled(const lh_context* ctx) { return ctx && ctx->cancelled.load() ? 1 : 0; }

lh_status lh_context_status(const lh_context* ctx) { return ctx ? ctx->status : LH_EINVAL; }

const char* lh_context_message(const lh_context* ctx) { return ctx ? ctx->message : "no context"; }

const char* lh_context_subject(const lh_context* ctx) { return ctx ? ctx->subject : ""; }
