#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>

#include <Eigen/Core>

namespace lumihull::calib {

/// Variance of a value v in linear light: read + gain · v (both >= 0, values 0 … 1).
struct PlaneNoise {
  double read = 1e-4;  ///< variance at black
  double gain = 0;
  double variance(double v) const { return read + gain * (v > 0 ? v : 0); }
};

/// One number a pixel, in linear light: what contours are measured on.
struct LightPlane {
  Image values;  ///< f32, 1 channel; 0 = black. Where a channel is clipped: `saturation`
  PlaneNoise noise;
  float saturation = 1;  ///< values from here on are clipped in some channel that counts for 5 % of the plane or more
};

/// Weights of red, green and blue, w · (R, G, B) in linear light, that tell ink from paper best: the direction of largest
/// contrast over noise (Fisher's discriminant for noise that is equal and independent in the channels). |w| sums to 1.
LUMIHULL_API Eigen::Vector3f contrast_weights(const Eigen::Vector3f& ink, const Eigen::Vector3f& paper);

/// The plane of a photograph (1, 3 or 4 channels, sRGB), weights · (R, G, B) / Σ |weights|; grey photographs have it as they
/// are. Float values that are not finite count as 0, others are limited to 0 … 1. Noise is estimated from the photograph
/// itself, where it is smooth, as a function of the value; rounding to 8 or 16 bits is its least.
/// Errors: invalid_argument (an empty picture; weights that are not finite, or all zero).
LUMIHULL_API LightPlane light_plane(const Image& photo, const Eigen::Vector3f& weights = {.25f, .5f, .25f});
/// The same on the job's threads.
LUMIHULL_API LightPlane light_plane(const Image& photo, const Eigen::Vector3f& weights, Job& job);

}  // namespace lumihull::calib
