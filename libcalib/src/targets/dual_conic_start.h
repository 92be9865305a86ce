// The dual-conic fit where its covariance is of no interest: the start of the maximum-likelihood fit.
#pragma once

#include <lumihull/calib/ellipse.h>

namespace lumihull::calib {

/// dual_conic_fit of options that are valid; the covariance stays zero unless asked for.
EllipseFit dual_conic_start(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options,
                            bool with_covariance);

}  // namespace lumihull::calib
