#include "nnls.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

namespace lumihull::capture::internal {

SmallVector non_negative_least_squares(const SmallMatrix& a, const SmallRows& f, SmallRows* residual) {
  const int n = int(a.cols());
  SmallVector scale(n), x = SmallVector::Zero(n);
  SmallMatrix unit = a;
  for (int j = 0; j < n; ++j) {
    const double norm = a.col(j).norm();
    scale[j] = norm > 0 ? 1 / norm : 0;
    unit.col(j) *= scale[j];
  }
  std::array<int, kMaxUnknowns> chosen{};  // columns with x > 0, in the order of their coming
  int count = 0;
  std::array<bool, kMaxUnknowns> inside{}, barred{};
  SmallRows rest = f;
  const double tolerance = 1e-14 * f.norm();
  const auto least_squares = [&] {
    SmallMatrix part(unit.rows(), count);
    for (int k = 0; k < count; ++k) part.col(k) = unit.col(chosen[std::size_t(k)]);
    return SmallVector(part.householderQr().solve(f));
  };
  // Each round lowers the residual, so no set of columns comes twice; the bound is for rounding alone.
  for (int round = 0; round < 10 * kMaxUnknowns && count < unit.rows(); ++round) {
    int best = -1;
    double steepest = tolerance;
    for (int j = 0; j < n; ++j)
      if (!inside[std::size_t(j)] && !barred[std::size_t(j)]) {
        const double slope = unit.col(j).dot(rest);
        if (slope > steepest) steepest = slope, best = j;
      }
    if (best < 0) break;
    chosen[std::size_t(count++)] = best, inside[std::size_t(best)] = true;
    SmallVector s = least_squares();
    // A column that the others span to rounding comes back with a wrong sign: it can't help (Lawson & Hanson, 23.10).
    if (!(s[count - 1] > 0) || !s.allFinite()) {
      inside[std::size_t(best)] = false, barred[std::size_t(best)] = true, --count;
      continue;
    }
    for (;;) {
      double step = 1;
      for (int k = 0; k < count; ++k)
        if (s[k] <= 0) {
          const double now = x[chosen[std::size_t(k)]];
          step = std::min(step, now / (now - s[k]));
        }
      if (step >= 1) break;
      for (int k = 0; k < count; ++k) {
        double& now = x[chosen[std::size_t(k)]];
        now += step * (s[k] - now);
        if (s[k] <= 0 && now <= 1e-15 * std::abs(s[k])) now = 0;
      }
      int kept = 0;
      for (int k = 0; k < count; ++k) {
        const int j = chosen[std::size_t(k)];
        if (x[j] > 0)
          chosen[std::size_t(kept++)] = j;
        else
          inside[std::size_t(j)] = false, x[j] = 0;
      }
      if (kept == count) break;  // only by rounding
      count = kept;
      if (count == 0) break;
      s = least_squares();
    }
    x.setZero();
    for (int k = 0; k < count; ++k) x[chosen[std::size_t(k)]] = std::max(0.0, s[k]);
    rest = f - unit * x;
    barred.fill(false);
  }
  *residual = f - unit * x;
  return x.cwiseProduct(scale);
}

bool least_distance(const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, 12>& g,
                    const SmallVector& h, double z_max, Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 12, 1>* z) {
  const int k = int(g.cols());
  SmallMatrix e(k + 1, g.rows());
  e.topRows(k) = g.transpose();
  e.row(k) = h.transpose();
  SmallRows f = SmallRows::Zero(k + 1), r;
  f[k] = 1;
  non_negative_least_squares(e, f, &r);
  // |r|² = r_k = 1 / (1 + |z|²) at the optimum, and 0 where G z >= h has no answer.
  const double least = 1 / (1 + z_max * z_max);
  if (!(r[k] > 0.5 * least)) return false;
  *z = -r.head(k) / r[k];
  return true;
}

}  // namespace lumihull::capture::internal
