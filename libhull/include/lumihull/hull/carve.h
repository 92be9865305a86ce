#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/field.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/silhouette.h>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::hull {

/// The zero level of a field as a closed, oriented, 2-manifold mesh: marching cubes with vertices shared along the
/// grid's edges. It is closed at the region's faces, too. Empty where no sample is inside.
LUMIHULL_API Mesh extract_surface(const Field& field, Job& job);

/// Keeps the connected parts whose volume is at least `min_share` of the largest one's; returns how many were removed.
/// Hollows count as parts of their own.
LUMIHULL_API std::size_t remove_specks(Mesh& mesh, double min_share);

struct CarveOptions {
  int resolution = 256;       ///< cubic voxels along the longest side of the region, 8 … 2048
  std::optional<Box> region;  ///< nullopt: found from cameras and silhouettes
  CarveRule rule;
  double min_component = 0.01;  ///< parts below this share of the largest part's volume are removed; 0: keep all
  /// Names of the views for messages (photographs); empty or one each.
  std::vector<std::string> names;
};

struct CarveStatistics {
  double region_seconds = 0, field_seconds = 0, mesh_seconds = 0;
  std::size_t samples_inside = 0, samples_evaluated = 0, views_evaluated = 0;  ///< see Field
  std::size_t field_bytes = 0, silhouette_bytes = 0;
  std::size_t specks_removed = 0;
  /// Least band of a silhouette, in voxels, at the middle of the region. Below about 1.75 the surface is placed
  /// coarsely: make the silhouettes with `silhouette_options` for this grid.
  double least_band_voxels = 0;
};

struct CarveResult {
  Mesh mesh;
  Grid grid;
  CarveStatistics statistics;
};

/// The visual hull of silhouettes as a mesh (paper, section 4).
/// Errors: invalid_argument, bad_input (views, see HullFunction), degenerate (no region is common to the views; the
/// hull vanishes: says which views carve everything away; a camera is inside the object), cancelled.
LUMIHULL_API CarveResult carve(std::span<const View> views, std::span<const Silhouette> silhouettes,
                               const CarveOptions& options, Job& job);

/// What one view does to a hull, counted on a coarse grid.
struct ViewBlame {
  std::size_t view = 0;
  double carves_alone = 0;  ///< share of the samples that all other views would keep but this one carves
};

struct Explanation {
  std::size_t fewest_carvers = 0;   ///< every sample is carved by at least so many views; 0: the hull isn't empty
  std::size_t best_seen = 0;        ///< views that see such a sample, at most
  std::vector<ViewBlame> suspects;  ///< views by how often they carve the samples that fewest views carve, most first
};

/// Why a hull vanishes in a region, or which views cut most from it: judged at 32 samples along the longest side.
LUMIHULL_API Explanation explain(const HullFunction& function, const Box& region, Job& job);

}  // namespace lumihull::hull
