#pragma once

// What is wrong with a photograph, as far as it shows in a small copy: hints for people, not measurements.

#include <lumihull/base/image.h>

namespace lumihull::capture::internal {

struct PictureHints {
  double clipped = 0;    ///< share of pixels with a channel of at least 254, 0 … 1
  double brightest = 0;  ///< 99 % of the pixels are not brighter, 0 … 255 (Rec. 709 weights, stored values)
  double edge_width =
      0;  ///< of its strongest edges, px of the given picture; the larger of both directions; 0: no edges
};

/// picture: 8 bits, RGB.
PictureHints picture_hints(const Image& picture);

}  // namespace lumihull::capture::internal
