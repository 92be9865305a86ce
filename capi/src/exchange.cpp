#include <lumihull/base/export.h>
#include <lumihull/calib/target_tracks.h>
#include <lumihull/base/import.h>

#include <vector>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

namespace {

constexpr size_t kMaxFiles = 100'000;

template <class Options>
Options import_options(const lh_import_options& o, const char* folder) {
  Options options;
  options.output = path(folder, "folder");
  options.reference = o.reference != 0;
  if constexpr (std::is_same_v<Options, RefitImportOptions>)
    options.max_refit_error_px = or_default(o.max_refit_error_px, options.max_refit_error_px);
  if constexpr (std::is_same_v<Options, ProjectionImportOptions>) options.first_pixel_center = 0.5 - o.pixel_shift;
  return options;
}

std::vector<std::filesystem::path> paths(const char* const* files, size_t n) {
  if (n == 0 || n > kMaxFiles) invalid("expected 1 to 100,000 files, found " + std::to_string(n), "n");
  std::vector<std::filesystem::path> list;
  for (const char* file : array(files, n, 1, "files")) list.emplace_back(path(file, "files"));
  return list;
}

void give_error(const ExportReport& report, double* largest_error_px) {
  if (largest_error_px) *largest_error_px = report.largest_refit_error_px;
}

ExportOptions export_options(double max_refit_error_px) {
  ExportOptions options;
  options.max_refit_error_px = or_default(max_refit_error_px, options.max_refit_error_px);
  return options;
}

}  // namespace

lh_status lh_capture_import_projections(lh_context* ctx, const char* listing, const char* folder,
                                        const lh_import_options* user, lh_capture** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const auto options = import_options<ProjectionImportOptions>(read_struct(user, "options"), folder);
    give(out, import_projections(path(listing, "listing"), options, job));
  });
}

lh_status lh_capture_import_middlebury(lh_context* ctx, const char* file, const char* folder,
                                       const lh_import_options* user, lh_capture** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const auto options = import_options<ImportOptions>(read_struct(user, "options"), folder);
    give(out, import_middlebury(path(file, "file"), options, job));
  });
}

lh_status lh_capture_import_nerf(lh_context* ctx, const char* const* files, size_t n, const char* folder,
                                 const lh_import_options* user, lh_capture** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const auto options = import_options<RefitImportOptions>(read_struct(user, "options"), folder);
    give(out, import_nerf(paths(files, n), options, job));
  });
}

lh_status lh_capture_import_colmap(lh_context* ctx, const char* model, const char* photos, const char* folder,
                                   const lh_import_options* user, lh_capture** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const auto options = import_options<RefitImportOptions>(read_struct(user, "options"), folder);
    give(out, import_colmap(path(model, "model"), path(photos, "photos"), options, job));
  });
}

lh_status lh_capture_import_photos(lh_context* ctx, const char* const* files, size_t n, const char* folder,
                                   const lh_import_options* user, lh_capture** out) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    const auto options = import_options<ImportOptions>(read_struct(user, "options"), folder);
    give(out, import_photos(paths(files, n), options, job));
  });
}

lh_status lh_capture_import_masks(lh_context* ctx, lh_capture* capture, const char* folder, size_t* count) {
  return guarded(ctx, [&](Job& job) {
    const int n = import_masks(given(capture, "capture").value, path(folder, "folder"), job);
    if (count) *count = size_t(n);
  });
}

lh_status lh_capture_import_enclosure(lh_context* ctx, lh_capture* capture, const char* const* files, size_t n,
                                      int32_t reference) {
  return guarded(
      ctx, [&](Job& job) { import_enclosure(given(capture, "capture").value, paths(files, n), reference != 0, job); });
}

lh_status lh_capture_export_colmap(lh_context* ctx, const lh_capture* capture, const char* folder,
                                   double max_refit_error_px, double* largest_error_px) {
  return guarded(ctx, [&] {
    const Capture& c = given(capture, "capture").value;
    give_error(export_colmap(c, path(folder, "folder"), export_options(max_refit_error_px), calib::target_tracks(c)),
               largest_error_px);
  });
}

lh_status lh_capture_export_nerf(lh_context* ctx, const lh_capture* capture, const char* file,
                                 double max_refit_error_px, double* largest_error_px) {
  return guarded(ctx, [&] {
    give_error(export_nerf(given(capture, "capture").value, path(file, "file"), export_options(max_refit_error_px)),
               largest_error_px);
  });
}
