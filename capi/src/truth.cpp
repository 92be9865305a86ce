#include <lumihull/base/files.h>
#include <lumihull/slf/truth.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

lh_status lh_truth_compare(lh_context* ctx, const lh_capture* capture, const char* truth, lh_truth_comparison** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    give(out, slf::compare_with_truth(given(capture, "capture").value, path(truth, "truth"), {}, job));
  });
}

void lh_truth_comparison_destroy(lh_truth_comparison* comparison) { delete comparison; }

lh_status lh_truth_comparison_describe(lh_context* ctx, const lh_truth_comparison* comparison, char* buffer,
                                       size_t size, size_t* needed) {
  return guarded(ctx, [&] { give_text(given(comparison, "comparison").value.to_json(), buffer, size, needed); });
}

lh_status lh_truth_comparison_page(lh_context* ctx, const lh_truth_comparison* comparison, const lh_capture* capture,
                                   const char* file) {
  return guarded(ctx, [&](Job& job) {
    const std::string name = path(file, "file");
    write_file(name, slf::truth_html(given(capture, "capture").value, given(comparison, "comparison").value, job));
  });
}
