#pragma once

#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "atlas/atlas.h"
#include "atlas/surface_samples.h"

namespace lumihull::slf {

/// By how much each photograph is brighter than all of them together, channel by channel, in linear light: the surface
/// is taken to have one colour T(p) for all, so that log c_i(p) = log T(p) + log gain_i, weighted least squares over
/// the texels that two photographs and more see, without those that are nearly black or clipped; gloss counts little
/// (Cauchy weights, reweighted). Gains' geometric mean is 1 over photographs that have common texels; one that has none
/// keeps 1. Photographs x RGB.
std::vector<Eigen::Vector3f> exposure_gains(const Atlas& atlas, std::span<const PhotoSamples> photos, Job& job);

/// Divides the samples' colours by the gain, in linear light.
void divide_by_gain(PhotoSamples& photo, const Eigen::Vector3f& gain);

}  // namespace lumihull::slf
