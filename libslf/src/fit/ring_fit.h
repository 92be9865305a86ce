#pragma once

#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "atlas/atlas.h"
#include "atlas/surface_samples.h"
#include "color.h"
#include "rings.h"

namespace lumihull::slf {

struct RingFitOptions {
  bool non_negative = false;
  int terms = 3;  // >= 1
  double view_smoothness = 0.02;
};

/// Factors as numbers. Surface maps, to be weighted with Λ: `surface` (Rings::texels x terms x 3). View maps: `view`
/// (vertices x nodes x terms), at the photographs of unit mean square (signed) or of mean 1 (non-negative).
struct RingFactors {
  std::vector<float> surface, view;
  double rms = 0;  // of the samples' weighted residuals
};

/// Light Field Mapping (Chen, Bouguet, Chu & Grzeszczuk 2002, 3): with Λ_v the share that vertex v has of a texel, the
/// light field is the sum of the rings' f_v = Λ_v f, and each ring's matrix (texels x 3 colours; photographs) is
/// factored on its own. Λ_v is then taken out of the surface maps again: it is known, and maps without it are smooth
/// and meet their neighbours where they do not count. Signed: the residual over the mean colour, by `pca`, photographs
/// weighted by how well they see the ring; what they don't see of it counts as the mean colour. Non-negative: the
/// colours themselves, by `nmf`, each sample with its weight. Photographs that see too little of a ring are left out;
/// rings of too few photographs have the mean colour.
///
/// colors: mean colour of each texel, all known.
RingFactors fit_rings(const hull::Mesh& mesh, const Atlas& atlas, const Rings& rings,
                      std::span<const PhotoSamples> photos, std::span<const Eigen::Vector3f> nodes,
                      std::span<const BlendColor> colors, const RingFitOptions& options, Job& job);

}  // namespace lumihull::slf
