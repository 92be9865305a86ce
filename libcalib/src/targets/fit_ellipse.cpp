// Maximum-likelihood fit of an ellipse with its edge profile.
#include <lumihull/calib/ellipse.h>

namespace lumihull::calib {

EllipseFit fit_ellipse(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options) {
  return dual_conic_fit(plane, guess, options);
}

}  // namespace lumihull::calib
