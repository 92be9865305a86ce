#pragma once

// A view made ready for projecting: world -> field coordinates, one 3 x 4 matrix, no lens.

#include <lumihull/hull/field.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "silhouettes/silhouette_data.h"

namespace lumihull::hull {

struct ProjectedView {
  /// (U, V, Z) = m (X, 1); field coordinates u = U / Z, v = V / Z, in cells; Z is the depth.
  Eigen::Matrix<double, 3, 4> m;
  const Silhouette::Data* field = nullptr;

  /// φ_i, NaN where the view doesn't see x.
  double phi(const Eigen::Vector3d& x) const {
    const double z = m(2, 0) * x[0] + m(2, 1) * x[1] + m(2, 2) * x[2] + m(2, 3);
    if (!(z > 0)) return NAN;
    const double u = (m(0, 0) * x[0] + m(0, 1) * x[1] + m(0, 2) * x[2] + m(0, 3)) / z;
    const double v = (m(1, 0) * x[0] + m(1, 1) * x[1] + m(1, 2) * x[2] + m(1, 3)) / z;
    return field->sample(u, v) * field->quantum * z;
  }
};

struct HullFunction::Impl {
  std::vector<Silhouette> silhouettes;
  std::vector<ProjectedView> views;
  CarveRule rule;
  int min_views = 1;  // after raising it to the tolerance

  /// The cuts' share of φ; -infinity without cuts.
  double cut(const Eigen::Vector3d& x) const;

  /// φ from a list of views; `deep_outside` more views are known to carve x, `seen` more to see it.
  /// scratch: at least `tolerance` doubles.
  template <class Indices>
  double phi(const Eigen::Vector3d& x, const Indices& list, int deep_outside, int seen, double* scratch) const {
    const int m = rule.tolerance - deep_outside;
    if (m <= 0) return std::numeric_limits<double>::infinity();
    std::fill_n(scratch, m, -std::numeric_limits<double>::infinity());  // the m largest, descending
    for (const std::size_t i : list) {
      const double d = views[i].phi(x);
      if (std::isnan(d)) continue;
      ++seen;
      if (d <= scratch[m - 1]) continue;
      int at = m - 1;
      for (; at > 0 && scratch[at - 1] < d; --at) scratch[at] = scratch[at - 1];
      scratch[at] = d;
    }
    if (seen < min_views) return std::numeric_limits<double>::infinity();
    return std::max(scratch[m - 1], cut(x));
  }
};

/// Signed distance of a point to what a box cuts away: positive inside the box.
double cut_by(const Box& box, const Eigen::Vector3d& x);

}  // namespace lumihull::hull
