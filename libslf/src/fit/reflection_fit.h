#pragma once

#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "atlas/atlas.h"
#include "atlas/surface_samples.h"
#include "mirror.h"

namespace lumihull::slf {

/// What all places mirror, each as strongly as its material does: linear light by the mirrored direction, on top of
/// each place's own colour.
struct ReflectionFit {
  Surroundings around;
  std::vector<Eigen::Vector3f> normals;  ///< of the vertices, unit length: those that it is mirrored by
  std::vector<float> strength;           ///< of the vertices, 0 … kMostStrength: how strongly they mirror
  /// Of a SphereGrid's nodes; then, as many, what comes on top where it is seen flatly, times grazing().
  std::vector<Eigen::Vector3f> light;
  /// Of the variance about each texel's mean colour, sRGB, at photographs that had no part in the fit, the share that
  /// it explains; below 0 where it does harm.
  double held = 0;
  double held_rms = 0;  ///< root mean square of that part, sRGB values 0 … 1
};

inline constexpr int kReflectionSide = 64;
inline constexpr float kMostStrength = 4;

/// min Σ w |c - T(p) - s(p) E(r)|² in linear light over all samples, r the eye's direction mirrored at p's normal, T
/// each texel's own, s interpolated from the vertices: E by conjugate gradients with T eliminated, smooth and drawn to
/// 0, and s of each vertex, drawn to 1, by turns. A sample that is white is at least so bright (it takes what the model
/// says where that is more). See README, "Reflections".
ReflectionFit fit_reflection(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
                             Job& job);

/// The samples as they would be without it.
void take_off(const ReflectionFit& fit, const hull::Mesh& mesh, const Atlas& atlas, std::span<PhotoSamples> photos,
              Job& job);

}  // namespace lumihull::slf
