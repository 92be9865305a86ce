#include <lumihull/base/error.h>
#include <lumihull/hull/carve_capture.h>

#include <cstdio>

#include "stage.h"

namespace lumihull::slf {

namespace {

const hull::HullStageOptions kDefaults;

hull::HullStageOptions options_of(const Capture& capture) {
  using List = std::vector<double>;
  const auto list = [&](const char* name, std::size_t multiple, const char* expected) {
    List values = effective<List>(capture, "hull", name);
    if (values.size() % multiple != 0)
      throw Error(ErrorCode::invalid_argument, std::string("expected ") + expected, name);
    return values;
  };
  const auto box = [](const double* v) { return hull::Box{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}; };

  hull::HullStageOptions o;
  o.resolution = int(effective<std::int64_t>(capture, "hull", "resolution"));
  o.rule.tolerance = int(effective<std::int64_t>(capture, "hull", "tolerance"));
  o.rule.min_views = int(effective<std::int64_t>(capture, "hull", "min_views"));
  o.min_component = effective<double>(capture, "hull", "min_component");
  o.max_triangles = std::size_t(effective<std::int64_t>(capture, "hull", "max_triangles"));
  const List region = list("region", 6, "x0,y0,z0,x1,y1,z1");
  if (region.size() > 6) throw Error(ErrorCode::invalid_argument, "expected x0,y0,z0,x1,y1,z1", "region");
  if (!region.empty()) o.region = box(region.data());
  const List planes = list("cut_plane", 4, "nx,ny,nz,offset, several one after the other");
  for (std::size_t i = 0; i < planes.size(); i += 4)
    o.rule.cut_planes.push_back({{planes[i], planes[i + 1], planes[i + 2]}, planes[i + 3]});
  const List boxes = list("cut_box", 6, "x0,y0,z0,x1,y1,z1, several one after the other");
  for (std::size_t i = 0; i < boxes.size(); i += 6) o.rule.cut_boxes.push_back(box(&boxes[i]));
  return o;
}

void inputs(const Capture& capture, InputDigest& digest) {
  add_cameras(capture, digest);
  add_masks(capture, digest);
}

bool present(const Capture& capture) { return file_exists(capture.hull_path()); }

std::vector<std::string> run(Capture& capture, Job& job) {
  const hull::HullReport report = hull::carve_capture(capture, options_of(capture), job);
  std::vector<std::string> said;
  char line[240];
  std::snprintf(line, sizeof line,
                "%zu silhouettes, %d x %d x %d voxels, %zu triangles%s; masks and fields %.2f s, carving %.2f s",
                report.photographs, report.grid.size[0], report.grid.size[1], report.grid.size[2], report.triangles,
                report.triangles < report.triangles_carved ? " after simplification" : "", report.silhouettes_seconds,
                report.carve_seconds);
  said.emplace_back(line);
  if (report.triangles < report.triangles_carved) {
    std::snprintf(line, sizeof line,
                  "simplified from %zu triangles in %.2f s; the surface moved by at most %.3g voxels",
                  report.triangles_carved, report.simplify_seconds, report.simplification_error / report.grid.voxel);
    said.emplace_back(line);
  }
  for (const std::string& warning : report.warnings) said.push_back("warning: " + warning);
  return said;
}

}  // namespace

const StageDefinition& hull_stage() {
  static const StageDefinition stage{
      "hull",
      2,
      {
          {"resolution", "cubic voxels along the longest side of the region", std::int64_t(kDefaults.resolution),
           hull::kMinResolution, hull::kMaxResolution},
          {"region", "box of space x0,y0,z0,x1,y1,z1; empty: found from cameras and silhouettes",
           std::vector<double>()},
          {"tolerance", "carve a point only where so many photographs say so; more than 1 is robust against bad masks",
           std::int64_t(kDefaults.rule.tolerance), 1, 1000},
          {"min_views", "what fewer photographs see is not object", std::int64_t(kDefaults.rule.min_views), 1, 1e6},
          {"min_component", "parts below this share of the largest part's volume are removed", kDefaults.min_component,
           0, 1},
          {"max_triangles", "simplify to at most so many triangles; 0: as carved",
           std::int64_t(kDefaults.max_triangles), 0, 1e9},
          {"cut_plane", "cut away nx,ny,nz,offset: where n.x > offset (a table)", std::vector<double>()},
          {"cut_box", "cut away the inside of x0,y0,z0,x1,y1,z1 (a support)", std::vector<double>()},
      },
      always_needed,  // without poses the stage itself says what is missing; leaving it out would hide that
      inputs,
      present,
      run};
  return stage;
}

}  // namespace lumihull::slf
