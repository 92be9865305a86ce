#pragma once

// The crossing of two edges of a chessboard, measured.

#include <lumihull/calib/light_plane.h>

#include <Eigen/Core>
#include <optional>

namespace lumihull::calib::lens {

struct Saddle {
  Eigen::Vector2d pixel{0, 0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  double blur_px = 1;
  /// Half the difference of the fields' values; > 0: those to the right of and below both edges, and opposite, are
  /// the lighter ones (as the edges' directions run).
  double contrast = 0;
  double residual = 1;  ///< RMS residual / expected noise
};

/// Fits (1 + g·d) (m + c E(n1·d) E(n2·d)), d = pixel - crossing, E the error function of an edge with Gaussian blur, to
/// the disc of `radius` px about `start`: nine unknowns (crossing, both edges' directions, m, c, blur, light's gradient
/// g). The pattern is symmetric about its crossing, and so is what blur makes of it: that E1 E2 is only exact for right
/// angles does not move the crossing. Pixels are weighted by their noise, and the covariance is (JᵀWJ)⁻¹, times the
/// residuals' mean square where that is above what noise explains.
///
/// along1, along2: the edges' directions, to about 15 degrees. nullopt: the disc leaves the picture, no contrast, or
/// the fit leaves its start by more than half the radius.
std::optional<Saddle> fit_saddle(const LightPlane& plane, const Eigen::Vector2d& start, const Eigen::Vector2d& along1,
                                 const Eigen::Vector2d& along2, double radius);

}  // namespace lumihull::calib::lens
