// Least squares of a blurred ellipse to a set of pixels.
#pragma once

#include <lumihull/calib/ellipse.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "blurred_ellipse.h"
#include "contour_band.h"

namespace lumihull::calib {

/// Values of an ellipse's picture:  (outside + step · w(p)) (1 + light · p / unit), p from an origin near its centre,
/// and what blurring makes of the light's change.
struct ContourModel {
  enum Index { cx, cy, root11, root12, root22, blur, outside, step, light_x, light_y, ratio, kSize };
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = Eigen::Matrix<double, kSize, kSize>;

  Vector p = Vector::Zero();  ///< px from the origin; blur: sigma of the profile, pixel included

  Eigen::Vector2d center() const { return p.head<2>(); }
  Eigen::Matrix2d root() const {
    Eigen::Matrix2d m;
    m << p[root11], p[root12], p[root12], p[root22];
    return m;
  }
};

/// Pixels of a band in blocks of eight that lie on one side of the ellipse, and the fit to them.
class ContourFit {
 public:
  static constexpr int kMaxSectors = 64;

  struct Sector {
    int pixels = 0, clipped = 0;
    double squares = 0;  ///< Σ residual² / (variance + tolerance²)
    /// How far the contour lies outward of where it should, in standard deviations, and of how many px one is.
    double shift = 0, shift_sd_px = 0;
    bool used = true;
  };

  explicit ContourFit(const LightPlane& plane, const Eigen::Vector2d& origin, double unit)
      : plane_(plane), origin_(origin), unit_(unit) {}

  /// Takes the band's pixels; `sectors` parts of the contour, equal in the ellipse's own angle.
  void gather(const Ellipse& ellipse, const BandWidth& band, int sectors);
  /// What the model expects of each pixel, for weigh, measure_sectors and robust_scale; solve leaves its answer's.
  void expect(const ContourModel& model, double inner_ratio);
  /// Weights of the pixels by the expected values; clipped ones (by value or by what is expected) and those of sectors
  /// that are not used count nothing.
  void weigh();

  /// Levenberg-Marquardt. robust > 0: the Geman-McClure loss r² / (1 + r²), r in units of `robust` standard deviations.
  /// inner_ratio: 0, or what is expected of a ring's. False where it left its basin.
  /// converged: squared length of a step, in standard deviations, that ends it.
  bool solve(ContourModel& model, int max_iterations, double converged, double robust, double inner_ratio);

  /// Residuals by sector, pixels of unused sectors included; tolerance: of the values.
  void measure_sectors(double tolerance);

  /// Median of |residual| / standard deviation, over 0.6745.
  double robust_scale();

  /// Takes the pixels for as uncertain as their residuals are, beside the contour and on its slope: noise grows, up to `most`
  /// times the plane's standard deviation, and weigh() adds (jitter · slope)² to the pixels' variance, up to `most_px`. For
  /// pictures whose edges are not a blurred step in linear light, whatever their smooth places say of noise: JPEG,
  /// demosaicing, sharpening, edges mixed in sRGB.
  void loosen(double most, double most_px);
  bool loosened() const { return jitter_px_ > 0 || noise_scale_ > 1; }

  std::vector<Sector>& sectors() { return sectors_; }
  /// Of the last solve: Σ residual² / variance, pixels that counted, inverse of the normal matrix.
  double squares() const { return squares_; }
  int pixels() const { return pixels_; }
  int clipped() const { return clipped_; }
  int gathered() const { return gathered_; }
  const ContourModel::Matrix& information() const { return information_; }

 private:
  struct Block {
    BlurredEllipse::Pixels pixels;
    Lanes value, weight, variance, expected, slope;  // slope: d expected / d (the contour moves outward by 1 px)
    std::array<std::uint8_t, kLanes> sector;
    std::uint8_t count = 0;
  };
  double evaluate(const ContourModel& model, double robust, ContourModel::Matrix* normal, ContourModel::Vector* right);
  template <class Body>
  void for_each_residual(const ContourModel& model, Body&& body);

  const LightPlane& plane_;
  Eigen::Vector2d origin_;
  double unit_;
  std::vector<Block> blocks_;
  std::vector<Sector> sectors_;
  BlurredEllipse share_;
  bool ring_ = false;
  double squares_ = 0, jitter_px_ = 0, noise_scale_ = 1;
  int pixels_ = 0, clipped_ = 0, gathered_ = 0;
  ContourModel::Matrix information_ = ContourModel::Matrix::Zero();
  double median_scale();  ///< standard deviation of noise with the absolute values in scratch_
  std::vector<float> scratch_;
};

}  // namespace lumihull::calib
