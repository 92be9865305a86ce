#pragma once

#include <lumihull/base/api.h>
#include <lumihull/calib/light_plane.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace lumihull::calib {

/// An ellipse in a picture: px, first pixel's centre (0.5, 0.5).
struct LUMIHULL_API Ellipse {
  Eigen::Vector2d center{0, 0};
  double a = 0, b = 0;  ///< semi-axes, a >= b > 0
  double angle = 0;     ///< of the longer axis, rad, from x towards y, in (-pi/2, pi/2]

  /// Dual conic C* (3 x 3, symmetric, C*(2,2) = 1): l is a tangent exactly if lᵀ C* l = 0. Centre = (C*02, C*12).
  Eigen::Matrix3d dual_conic() const;
  /// nullopt where C* is no real ellipse.
  static std::optional<Ellipse> from_dual_conic(const Eigen::Matrix3d& dual);
  /// The matrix Q (2 x 2, px²) whose eigenvalues are a², b²: the contour is (x - c)ᵀ Q⁻¹ (x - c) = 1, and the dual conic's
  /// first block is c cᵀ - Q.
  Eigen::Matrix2d shape() const;
  /// nullopt where Q is not positive definite.
  static std::optional<Ellipse> from_shape(const Eigen::Vector2d& center, const Eigen::Matrix2d& shape);
  Eigen::Vector2d point(double t) const;  ///< center + a cos t (cos, sin of angle) + b sin t (-sin, cos of angle)
};

enum class EllipseState : std::uint8_t {
  good,
  no_fit,     ///< the answer is no ellipse, or the iteration left its basin
  at_border,  ///< the contour leaves the picture
  occluded,   ///< part of the contour is hidden or disturbed: more than the options allow
  saturated,  ///< too much of the contour's neighbourhood is clipped
  no_contrast,
};

/// What was measured of one ellipse.
struct EllipseFit {
  EllipseState state = EllipseState::no_fit;
  Ellipse ellipse;
  /// Covariance of (center x, center y, Q11, Q12, Q22), px and px², Q = Ellipse::shape(), by propagating the pixels' noise
  /// through the estimator. The first 2 x 2 block is the centre's.
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  double inside = 0, outside = 0;  ///< values of the plane on both sides of the contour
  double blur_px = 0;              ///< sigma of the edge's profile
  /// RMS residual / expected noise: about 1 where the model holds, less where neighbouring pixels' noise is correlated
  /// (demosaicing). fit_ellipse only.
  double residual = 0;
  double visible = 1;  ///< part of the contour that was used

  Eigen::Matrix2d center_covariance() const { return covariance.topLeftCorner<2, 2>(); }
};

struct LUMIHULL_API EllipseOptions {
  double gradient_sigma_px = 1;   ///< of the derivative of a Gaussian, 0.5 … 5
  double min_visible = 0.6;       ///< of the contour, 0 … 1
  /// Of the contour's neighbourhood, 0 … 1. Clipped pixels are left out; where all of the paper is clipped the lower part
  /// of the edge still says where the contour is.
  double max_saturated = 0.9;
  double min_contrast_noise = 5;  ///< contrast over noise, below which nothing is measured
  /// Of a ring: diameter of the concentric inner contour over that of the one that is measured, 0 … 0.9. 0: a disc.
  double inner_ratio = 0;
  /// Of a ring: centre of the inner contour less that of the outer one, px. Where concentric circles are seen obliquely
  /// from nearby their ellipses are not concentric.
  Eigen::Vector2d inner_offset{0, 0};

  void validate() const;
};

/// Ouellet & Hébert's dual-conic operator (CRV 2007; Machine Vision and Applications 2009), as published: each pixel of a
/// band around `guess` gives a tangent line l = (gx, gy, -(gx x + gy y)) by its gradient, and the dual conic F* = 1 is the
/// linear least-squares answer of lᵀ C* l = 0, lines unnormalised so that strong gradients count. Coordinates are moved
/// to the guess's centre and scaled. guess: within a few px.
LUMIHULL_API EllipseFit dual_conic_fit(const LightPlane& plane, const Ellipse& guess,
                                       const EllipseOptions& options = {});

/// Maximum-likelihood fit of an ellipse with its edge profile (two levels, Gaussian blur, pixel integration, light that
/// changes linearly) to all pixels near the contour, weighted by their noise; starts from the dual-conic fit. Reaches the
/// Cramér-Rao bound for this model (libcalib/README.md). The blurred ellipse is exact for any curvature; a ring's inner
/// contour (options.inner_ratio) is part of the model where both are near each other.
///
/// The band reaches as far as the edge's profile and the light's levels need, at most to 1.8 times the ellipse: circles may
/// stand as far apart as they are wide. Parts of the contour whose residuals are more than noise are left out, and `visible`
/// and the covariance say so; where what is left is too little, or does not look like an ellipse, the state does. The covariance
/// grows where residuals are larger than the noise explains.
/// guess: within a tenth of the axes or 1 px, whichever is more. Takes time in proportion to the contour's length.
LUMIHULL_API EllipseFit fit_ellipse(const LightPlane& plane, const Ellipse& guess, const EllipseOptions& options = {});

}  // namespace lumihull::calib
