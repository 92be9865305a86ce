#pragma once

// Zhang's own camera model, for comparing with his published answer: skew, and a polynomial from the ray to the
// picture.

#include <lumihull/calib/lens_calibration.h>

#include <Eigen/Core>
#include <vector>

namespace lumihull::test {

/// u = u0 + (alpha x + gamma y) (1 + k1 r² + k2 r⁴), v = v0 + beta y (1 + k1 r² + k2 r⁴) (Zhang 2000, section 3.3).
struct ZhangModel {
  double alpha = 0, gamma = 0, beta = 0, u0 = 0, v0 = 0, k1 = 0, k2 = 0;
  std::vector<Pose> cam_from_board;
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / points)
};

/// Least squares from a start, dense and by central differences: a few views only.
ZhangModel adjust_zhang_model(std::span<const calib::BoardView> views, const ZhangModel& start);

}  // namespace lumihull::test
