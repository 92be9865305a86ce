#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/carve_capture.h>
#include <lumihull/hull/region.h>
#include <lumihull/hull/simplify.h>

#include <chrono>

namespace lumihull::hull {

HullReport carve_capture(const Capture& capture, const HullStageOptions& options, Job& job) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  std::vector<std::size_t> shots;
  std::vector<View> views;
  CarveOptions carving;
  std::size_t positioned = 0;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    positioned += capture.positioned(i);
    if (!capture.positioned(i) || capture.held_out(i)) continue;
    const Shot& shot = capture.shots[i];
    if (!std::filesystem::exists(capture.mask_path(shot)))
      throw Error(ErrorCode::not_found, "the photograph has no mask: key it, or put one there",
                  capture.mask_path(shot).string());
    shots.push_back(i);
    views.push_back(capture.view(i));
    carving.names.push_back(shot.name);
  }
  if (shots.size() < 2) {
    const std::string needs = "a hull needs at least 2 photographs with poses that are not held out; ";
    throw Error(ErrorCode::degenerate,
                needs + (positioned == 0 ? "none has a pose: import cameras with the photographs"
                                         : std::to_string(positioned) + " of " + std::to_string(capture.shots.size()) +
                                               " have poses, and " + std::to_string(positioned - shots.size()) +
                                               " of these are held out"),
                capture.folder().string());
  }
  carving.resolution = options.resolution;
  carving.rule = options.rule;
  carving.min_component = options.min_component;

  HullReport report;
  auto start = Clock::now();
  std::vector<Silhouette> silhouettes = make_silhouettes(
      views, [&](std::size_t i) { return capture.read_mask(shots[i]); }, options.region, options.resolution,
      options.rule, carving.names, job);
  report.silhouettes_seconds = seconds_since(start);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    if (silhouettes[i].is_empty() || silhouettes[i].is_full()) {
      report.warnings.push_back(carving.names[i] + ": its mask is " + (silhouettes[i].is_empty() ? "empty" : "full") +
                                "; the photograph is left out of the hull");
      continue;
    }
    if (kept != i) {
      silhouettes[kept] = silhouettes[i];
      views[kept] = views[i];
      carving.names[kept] = carving.names[i];
    }
    ++kept;
  }
  silhouettes.erase(silhouettes.begin() + std::ptrdiff_t(kept), silhouettes.end());
  views.resize(kept);
  carving.names.resize(kept);
  if (kept < 2)
    throw Error(ErrorCode::degenerate,
                std::to_string(kept) + " of " + std::to_string(shots.size()) +
                    " masks have object and background; a hull needs at least 2",
                capture.folder().string());

  start = Clock::now();
  carving.region = options.region;
  CarveResult result = carve(views, silhouettes, carving, job);
  report.carve_seconds = seconds_since(start);
  report.grid = result.grid;
  report.statistics = result.statistics;
  report.photographs = kept;
  report.triangles_carved = result.mesh.triangles.size();
  if (options.max_triangles > 0 && result.mesh.triangles.size() > options.max_triangles) {
    start = Clock::now();
    SimplifyResult simple = simplify(result.mesh, {options.max_triangles, 0}, job);
    report.simplification_error = simple.moved.max;
    if (!simple.reached)
      report.warnings.push_back("the surface can't be simplified below " +
                                std::to_string(simple.mesh.triangles.size()) + " triangles without tearing it");
    result.mesh = std::move(simple.mesh);
    report.simplify_seconds = seconds_since(start);
  }
  report.vertices = result.mesh.vertices.size();
  report.triangles = result.mesh.triangles.size();
  report.volume = enclosed_volume(result.mesh);
  write_mesh(capture.hull_path(), result.mesh);
  report.peak_bytes = peak_memory_bytes();
  return report;
}

}  // namespace lumihull::hull
