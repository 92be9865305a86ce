#pragma once

// What LumigraphOptions and TextureOptions have in common: how photographs are looked at from the surface.

#include <lumihull/base/error.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Geometry>

#include "prepared_photo.h"

namespace lumihull::slf {

/// Throws Error{invalid_argument} with `what` was expected unless `good`. whose: "texture options".
inline void require(bool good, const char* what, const char* whose) {
  if (!good) throw Error(ErrorCode::invalid_argument, what, whose);
}

template <class Options>
void check_photo_options(const Options& o, const char* whose) {
  require(o.min_cosine >= 0 && o.min_cosine < 1, "min_cosine: expected 0 to less than 1", whose);
  require(o.visibility_offset >= 0 && o.visibility_offset <= 1, "visibility_offset: expected 0 to 1", whose);
  require(o.erosion_px >= 0 && o.erosion_px <= 64, "erosion_px: expected 0 to 64", whose);
  require(o.feather_px >= 0 && o.feather_px <= 16, "feather_px: expected 0 to 16", whose);
  require(o.edge_alpha >= 0 && o.edge_alpha <= 1, "edge_alpha: expected 0 to 1", whose);
}

template <class Options>
EdgeOptions edge_options(const Options& o) {
  return {float(o.erosion_px), float(o.feather_px), float(o.edge_alpha)};
}

/// Where shadow rays start beside the surface, world units. visibility_offset: in diagonals of the mesh's box.
inline float shadow_offset(const hull::Mesh& mesh, double visibility_offset) {
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  return box.isEmpty() ? 0.0f : float(visibility_offset) * box.diagonal().norm();
}

}  // namespace lumihull::slf
