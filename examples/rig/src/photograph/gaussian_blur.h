#pragma once

#include <lumihull/base/image.h>

#include <cstddef>
#include <vector>

namespace lumihull::rig {

inline constexpr double kGaussianReach = 4.5;  ///< sigmas

/// Samples of a Gaussian at -reach … reach with the sum 1.
std::vector<float> gaussian_samples(double sigma, int reach);

/// out += g in
void add_scaled(float* out, float g, const float* in, std::size_t n);

/// A Gaussian of `sigma` px, in place, over an image of f32 with any channels; beyond the border it is as at the
/// border.
void gaussian_blur(Image& image, double sigma);

}  // namespace lumihull::rig
