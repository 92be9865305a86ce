// Least squares of a blurred ellipse to a set of pixels.
#pragma once

#include <lumihull/calib/ellipse.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "blurred_ellipse.h"
#include "contour_band.h"
#include "curved_edge.h"

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

/// How a model's values are summed.
enum class ContourSum : std::uint8_t {
  exact,  ///< along the whole contour, always
  quick,  ///< about the nearest point where the curvature allows, and as far off as it is from the exact sum
};

/// Pixels of a band in blocks of eight that lie on one side of the ellipse, and the fit to them.
///
/// With ContourSum::quick a fit iterates on CurvedEdge's share plus, pixel by pixel, what the exact sum differed by at
/// a model nearby. It ends where the model has moved so little since that the difference can't have changed by what
/// matters: the answer is the exact sum's (a defect correction, Stetter 1978), only the derivatives are CurvedEdge's.
/// Pixels beyond the Gaussian's reach show a plain level.
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

  ContourFit(const LightPlane& plane, const Eigen::Vector2d& origin, double unit, ContourSum sum)
      : plane_(plane), origin_(origin), unit_(unit), sum_(sum) {}

  /// Takes the pixels of the band about a model's contour; `sectors` parts of the contour, equal in the ellipse's own
  /// angle. inner_ratio: 0, or what is expected of a ring's; inner_offset: of its contour's centre. rough: for an
  /// answer that is but a start, so a quick sum is only corrected where it is far off.
  void gather(const Ellipse& ellipse, const ContourModel& model, const BandWidth& band, int sectors, double inner_ratio,
              const Eigen::Vector2d& inner_offset, bool rough);
  /// What the model expects of each pixel, for weigh, measure_sectors and robust_scale; solve leaves its answer's.
  void expect(const ContourModel& model);
  /// Weights of the pixels by the expected values; clipped ones (by value or by what is expected) and those of sectors
  /// that are not used count nothing.
  void weigh();

  /// Levenberg-Marquardt. robust > 0: the Geman-McClure loss r² / (1 + r²), r in units of `robust` standard deviations.
  /// False where it left its basin. converged: squared length of a step, in standard deviations, that ends it.
  /// weigh_first: as expect and weigh would at the start, in the same pass.
  bool solve(ContourModel& model, int max_iterations, double converged, double robust, bool weigh_first = false);

  /// Residuals by sector, pixels of unused sectors included; tolerance: of the values.
  void measure_sectors(double tolerance);

  /// Median of |residual| / standard deviation, over 0.6745.
  double robust_scale();

  /// Takes the pixels for as uncertain as their residuals are, beside the contour and on its slope: noise grows, up to
  /// `most` times the plane's standard deviation, and weigh() adds (jitter · slope)² to the pixels' variance, up to
  /// `most_px`. For pictures whose edges are not a blurred step in linear light, whatever their smooth places say of
  /// noise: JPEG, demosaicing, sharpening, edges mixed in sRGB.
  void loosen(double most, double most_px);
  /// The same by the RMS of the last solve, for residuals that have longer tails than noise; false where it changes
  /// nothing.
  bool loosen_more(double most, double most_px);
  bool loosened() const { return jitter_px_ > 0 || noise_scale_ > 1; }

  std::vector<Sector>& sectors() { return sectors_; }
  bool quick() const { return quick_; }  ///< whether the expansion serves the pixels that were gathered
  /// Of the last solve: Σ residual² / variance, pixels that counted, inverse of the normal matrix.
  double squares() const { return squares_; }
  int pixels() const { return pixels_; }
  int clipped() const { return clipped_; }
  int gathered() const { return gathered_; }
  const ContourModel::Matrix& information() const { return information_; }

 private:
  enum class Part : std::uint8_t { edge, outside, inside };
  struct Block {
    BlurredEllipse::Pixels pixels;
    Lanes value, weight, variance, expected, slope;  // slope: d expected / d (the contour moves outward by 1 px)
    CurvedEdge::Foot foot, inner_foot;
    Lanes correction;  // of the quick share
    std::array<std::uint8_t, kLanes> sector;
    std::uint8_t count = 0;
    Part part = Part::edge;
  };
  void set(const ContourModel& model);
  bool iterate(ContourModel& model, int max_iterations, double converged, double robust, double& rate);
  bool corrected(const ContourModel& model) const;
  double evaluate(const ContourModel& model, double robust, ContourModel::Matrix& normal, ContourModel::Vector& right);
  void start_weighing();
  void weigh(Block& block);
  /// Sets what is expected of each pixel, and calls body(block, share, light, plain light, residual). Where
  /// correct_next_ says so the quick share is made the exact one at this model.
  template <class Body>
  void for_each_residual(const ContourModel& model, Body&& body);

  const LightPlane& plane_;
  Eigen::Vector2d origin_;
  double unit_, longest_ = 0;
  std::vector<Block> blocks_;
  std::vector<Sector> sectors_;
  ContourSum sum_;
  BlurredEllipse exact_;
  CurvedEdge outer_, inner_;
  bool quick_ = false;  // of the pixels that were gathered
  bool rough_ = false, correct_next_ = false, weigh_next_ = false, all_used_ = true;
  ContourModel corrected_at_, feet_at_;
  double curvature_ = 0;    // the largest κ s
  double inner_ratio_ = 0;  // 0: no ring
  Eigen::Vector2d inner_offset_{0, 0};
  double squares_ = 0, jitter_px_ = 0, noise_scale_ = 1;
  int pixels_ = 0, clipped_ = 0, gathered_ = 0;
  ContourModel::Matrix information_ = ContourModel::Matrix::Zero();
  double median_scale();  ///< standard deviation of noise with the absolute values in scratch_
  std::vector<float> scratch_;
};

}  // namespace lumihull::calib
