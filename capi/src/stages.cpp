#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/results.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using Json = nlohmann::ordered_json;

namespace {

std::string options_json(std::string_view stage) {
  constexpr double kMax = std::numeric_limits<double>::max();
  Json list = Json::array();
  for (const slf::OptionSpec& spec : slf::stage_options(stage)) {
    Json option{{"name", spec.name}, {"help", spec.help}};
    std::visit([&](const auto& v) { option["default"] = v; }, spec.fallback);
    if (spec.low > -kMax) option["low"] = spec.low;
    if (spec.high < kMax) option["high"] = spec.high;
    if (!spec.choices.empty()) option["choices"] = spec.choices;
    if (spec.path) option["path"] = true;
    list.push_back(std::move(option));
  }
  return list.dump(1);
}

void report(const slf::StageResult& result, lh_stage_fn fn, void* user) {
  if (!fn) return;
  std::vector<const char*> lines;
  for (const std::string& line : result.said) lines.push_back(line.c_str());
  const lh_stage_result c{sizeof(lh_stage_result), result.stage.c_str(), result.skipped ? 1 : 0,
                          uint32_t(lines.size()),  lines.data(),         result.record.seconds,
                          result.record.peak_bytes};
  fn(user, &c);
}

}  // namespace

size_t lh_stage_count(void) { return slf::stage_names().size(); }

const char* lh_stage_name(size_t i) {
  // The names are literals: they end with NUL.
  return i < slf::stage_names().size() ? slf::stage_names()[i].data() : nullptr;
}

lh_status lh_stage_options(lh_context* ctx, const char* stage, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] { give_text(options_json(text(stage, "stage")), buffer, size, needed); });
}

lh_status lh_capture_set_option(lh_context* ctx, lh_capture* capture, const char* stage, const char* name,
                                const char* value) {
  return guarded(ctx, [&] {
    slf::set_option_text(given(capture, "capture").value, text(stage, "stage"), text(name, "name"),
                         text(value, "value"));
  });
}

lh_status lh_capture_get_option(lh_context* ctx, const lh_capture* capture, const char* stage, const char* name,
                                char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    const Capture& c = given(capture, "capture").value;
    give_text(slf::option_text(slf::effective_option(c, text(stage, "stage"), text(name, "name"))), buffer, size,
              needed);
  });
}

lh_status lh_capture_describe(lh_context* ctx, const lh_capture* capture, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] { give_text(slf::describe_json(given(capture, "capture").value), buffer, size, needed); });
}

lh_status lh_capture_run_stage(lh_context* ctx, lh_capture* capture, const char* stage, int32_t force, lh_stage_fn fn,
                               void* user) {
  return guarded(ctx, [&](Job& job) {
    report(slf::run_stage(given(capture, "capture").value, text(stage, "stage"), job, force != 0), fn, user);
  });
}

lh_status lh_capture_run(lh_context* ctx, lh_capture* capture, int32_t force, lh_stage_fn fn, void* user) {
  return guarded(ctx, [&](Job& job) {
    slf::run(given(capture, "capture").value, job, force != 0,
             [&](const slf::StageResult& result) { report(result, fn, user); });
  });
}

lh_status lh_capture_evaluation(lh_context* ctx, const lh_capture* capture, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] { give_text(slf::read_evaluation(given(capture, "capture").value), buffer, size, needed); });
}
