#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/capture.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/carve.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::hull {

struct HullStageOptions {
  int resolution = 256;           ///< cubic voxels along the longest side of the region, 8 … 2048
  std::optional<Box> region;      ///< nullopt: found from cameras and silhouettes
  CarveRule rule{1, 2, {}, {}};   ///< min_views 2: what one photograph alone sees goes on without end
  double min_component = 0.01;    ///< see CarveOptions
  std::size_t max_triangles = 0;  ///< simplified to at most so many; 0: as carved
};

struct HullReport {
  Grid grid;
  CarveStatistics statistics;
  std::size_t photographs = 0;  ///< whose silhouettes were carved with
  std::size_t vertices = 0, triangles = 0;
  std::size_t triangles_carved = 0;  ///< before simplification
  double volume = 0;                 ///< cubed world units
  double simplification_error = 0;   ///< largest distance between the surfaces before and after, world units
  double silhouettes_seconds = 0;    ///< reading masks and their distance fields
  double carve_seconds = 0;          ///< region, field, surface
  double simplify_seconds = 0;
  std::uint64_t peak_bytes = 0;       ///< high-water mark of the process since its last reset
  std::vector<std::string> warnings;  ///< a line each, naming the photograph
};

/// The capture's stage "hull": carves with the masks of all positioned photographs that are not held out, and writes
/// hull.ply atomically. Masks are streamed. Photographs whose mask is empty or full are left out, with a warning.
/// Errors: not_found (a photograph without mask), degenerate (fewer than two usable silhouettes; see carve), bad_input,
/// invalid_argument, io, cancelled.
LUMIHULL_API HullReport carve_capture(const Capture& capture, const HullStageOptions& options, Job& job);

}  // namespace lumihull::hull
