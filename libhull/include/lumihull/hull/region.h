#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/field.h>
#include <lumihull/hull/silhouette.h>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumihull::hull {

/// The box around the visual hull, found from cameras and silhouettes: the pyramids around the silhouettes are
/// intersected, the result is carved coarsely and conservatively (thin parts are not lost), grown where the hull goes
/// on, and tightened. No scale or position is assumed. At most 40 views, evenly spread, are looked at: the whole hull
/// lies within theirs.
///
/// names: of the views, for messages; empty or one each.
/// Errors: degenerate (the views have no bounded region in common; the hull vanishes), as HullFunction, cancelled.
LUMIHULL_API Box find_region(std::span<const View> views, std::span<const Silhouette> silhouettes,
                             const CarveRule& rule, std::span<const std::string> names, Job& job);

/// The field that a voxel's footprint needs: cells of a quarter of a voxel, distances exact to 1.75 voxels of the
/// region's nearest corner.
LUMIHULL_API SilhouetteOptions silhouette_options(const View& view, const Box& region, int resolution);

/// Silhouettes of many masks, streamed: `load(i)` returns the i-th mask and is called from several threads; few masks
/// are in memory at a time. Without a region 24 masks (all of them, where most of these are empty or full) are looked at
/// coarsely first to know the voxels' size.
/// An error about a mask gets names[i] as its subject.
LUMIHULL_API std::vector<Silhouette> make_silhouettes(std::span<const View> views,
                                                      const std::function<Image(std::size_t)>& load,
                                                      const std::optional<Box>& region, int resolution,
                                                      const CarveRule& rule, std::span<const std::string> names,
                                                      Job& job);

}  // namespace lumihull::hull
