#pragma once

#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "grey_pyramid.h"

namespace lumihull::calib {

/// A dark spot that may be a circle's picture: an ellipse by the moments of its outline, filled.
struct Blob {
  Eigen::Vector2d center{0, 0};  ///< px of the photograph
  /// (x - center)ᵀ shape⁻¹ (x - center) = 1 on the contour, px².
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();
  double a = 0, b = 0;        ///< semi-axes, px, a >= b
  float dark = 0, light = 0;  ///< grey values about it
  int level = 0;              ///< of the pyramid, where it was found
};

struct BlobOptions {
  double min_circle_px = 4.5;  ///< smallest minor axis (full), px of the photograph
  int min_contrast = 12;       ///< grey values
  /// Spots darker and lighter than their paper stand side by side: a third threshold, a quarter of the way up.
  bool both_kinds = false;
};

/// Dark ellipses of all sizes. Each level is thresholded between the smallest and the largest value of 3 x 3 tiles of 8
/// x 8 px, where these differ by more than noise does, and looked through for spots of 4 to 40 px: so that a circle of
/// any size is seen where the threshold is as local as the circle is small. What two levels see is kept once. Ordered
/// by level, then by place; does not depend on the number of threads.
///
/// ink: of the same size, 0 = ink by its key, or null. Where it is given, spots are looked for in it and in `grey`
/// close to ink: the key tells where, but a small ring's wall is a mixture of colours, and not ink to it.
/// Light spots are the dark ones of the negative (grey_pyramid.h).
std::vector<Blob> find_blobs(const GreyPyramid& grey, const GreyPyramid* ink, const BlobOptions& options, Job& job);

}  // namespace lumihull::calib
