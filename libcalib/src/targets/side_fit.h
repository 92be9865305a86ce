#pragma once

#include <lumihull/calib/light_plane.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace lumihull::calib {

/// Where one side of a dark square on light paper runs: a chord and the edge's signed distance from it.
///
/// u = -1 … 1 along the chord from one corner to the next (clockwise in the picture, so that the dark square lies to the
/// right), d = distance along the normal, > 0 on the paper: d = e(u) = c · basis(u).
struct SideCurve {
  Eigen::Vector2d middle{0, 0}, along{1, 0};
  double length = 0;
  Eigen::Vector3d c{0, 0, 0};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of c, px²

  static SideCurve between(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  /// The third function has no mean, so that a side without curvature keeps its place.
  static Eigen::Vector3d basis(double u) { return {1, u, u * u - 1.0 / 3}; }
  Eigen::Vector2d normal() const { return {along.y(), -along.x()}; }
  double offset(double u) const { return c.dot(basis(u)); }
  Eigen::Vector2d point(double u) const { return middle + along * (0.5 * length * u) + normal() * offset(u); }
  Eigen::Vector2d tangent(double u) const;  ///< unit length
  double variance(double u) const { return basis(u).dot(covariance * basis(u)); }
};

/// The light cells behind the square's border, which a blurred border is brightened by: for the first two rows behind
/// it, which of `columns` cells are light, and where they begin in (u, d).
struct CellsBehind {
  int columns = 0;
  std::array<std::uint64_t, 2> light{};                 ///< bit i: cell i of the row is light
  std::array<std::vector<Eigen::Vector2d>, 3> corners;  ///< columns + 1 places (u, d) on the rows' upper edges
  bool known() const { return columns > 0; }
};

/// What a side's levels and blur are expected to be, and how surely (standard deviations): from the square's other sides.
struct SideExpectation {
  double dark = 0, light = 0, level_sd = 0;
  double blur_px = 0, blur_sd = 0;
};

struct SideBand {
  double module_px = 0;        ///< thickness of the dark border along the normal
  double margin_px = 0;        ///< how far out of the edge the paper is bare
  double curvature_sd = 0;     ///< 1/px: what lenses and sheets make of a straight side (a Gaussian prior)
  double light_slope = 0;      ///< relative change of the light for each px outwards
  std::optional<SideExpectation> expected;
  int stride = 1;  ///< only each so-manieth row or column of the band is looked at
};

struct SideFit {
  SideCurve curve;
  double dark = 0, light = 0;  ///< levels at the side's middle
  double light_slope = 0;      ///< relative change of the paper's level along the chord, for each px
  double blur_px = 1;          ///< sigma of the edge's profile
  double dark_variance = 0, light_variance = 0, blur_variance = 0;
  double residual = 0;         ///< RMS residual / expected noise
  double visible = 1;          ///< share of the side that was used
};

/// Finds the side within `reach_px` of the chord by profiles across it, to a fraction of a px. nullopt: no edge from dark
/// to light that most profiles agree on.
std::optional<SideCurve> find_side(const LightPlane& plane, const SideCurve& chord, double reach_px,
                                   double curvature_sd);

/// Maximum-likelihood fit of a side with its edge profile (EdgeProfile), two levels that may change along it, and its
/// curvature, to the pixels in a band around the chord that are away from the corners; each weighted by its noise. Clipped
/// pixels do not count: where all of the paper is clipped the lower part of the edge says where it is.
/// Parts whose residuals stand out are left out. The covariance is that of the fit, times chi² / freedom where that is
/// above 1. nullopt: too few pixels, or the iteration left the neighbourhood of `start`.
std::optional<SideFit> fit_side(const LightPlane& plane, const SideCurve& start, const SideBand& band,
                                const CellsBehind& behind);

}  // namespace lumihull::calib
