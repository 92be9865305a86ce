#pragma once

#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "atlas.h"
#include "sphere_grid.h"
#include "surface_samples.h"

namespace lumihull::slf {

/// What all places mirror alike: linear light by the mirrored direction, on top of each place's own colour.
struct ReflectionFit {
  std::vector<Eigen::Vector3f> normals;  ///< of the vertices, unit length: those that it is mirrored by
  /// Of a SphereGrid's nodes; then, as many, what comes on top where it is seen flatly, times grazing().
  std::vector<Eigen::Vector3f> light;
  double left = 1;           ///< of the samples' variance about each texel's mean colour, the share that is left
  double explained_rms = 0;  ///< root mean square of the part that is not, linear light
};

inline constexpr int kReflectionSide = 64;

/// min Σ w |c - T(p) - E(r)|² in linear light over all samples, r the eye's direction mirrored at p's normal, T each
/// texel's own: linear in T and E, by conjugate gradients with T eliminated, E smooth and drawn to 0. A sample that is
/// white is at least so bright (it takes what the model says where that is more). See README, "Reflections".
ReflectionFit fit_reflection(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
                             Job& job);

/// The samples as they would be without it.
void take_off(const ReflectionFit& fit, const hull::Mesh& mesh, const Atlas& atlas, std::span<PhotoSamples> photos,
              Job& job);

}  // namespace lumihull::slf
