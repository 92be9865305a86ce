// Fits of ellipses by how they start.
#pragma once

#include <lumihull/calib/ellipse.h>

namespace lumihull::calib {

/// dual_conic_fit of options that are valid; the covariance stays zero unless asked for.
EllipseFit dual_conic_start(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options,
                            bool with_covariance);

/// fit_ellipse of options that are valid. blur_px > 0: the picture's blur, of its other contours. Then the guess itself
/// is the first start, and the dual conic only where that one leads to nothing; 0: it always is.
EllipseFit fit_ellipse(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options, double blur_px);

}  // namespace lumihull::calib
