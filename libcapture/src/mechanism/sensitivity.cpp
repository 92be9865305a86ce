// How far the platform moves when cables are longer or shorter than they should be.
#include <lumihull/capture/sensitivity.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <limits>

namespace lumihull::capture {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kRank = 1e-8;

/// The largest value over |Wᵀ ξ|∞ <= 1 of a convex function is at a vertex: six cables at ±1, the others within. Of a
/// vertex and its mirror image one is enough.
void look_at_vertices(const WrenchMatrix& w, const std::array<int, 6>& chosen, Sensitivity* result) {
  Matrix6 part;
  for (int k = 0; k < 6; ++k) part.row(k) = w.col(chosen[std::size_t(k)]).transpose();
  const Eigen::FullPivLU<Matrix6> lu(part);
  if (std::abs(lu.matrixLU().diagonal()[5]) < kRank) return;
  const Matrix6 inverse = lu.inverse();
  for (int signs = 0; signs < 32; ++signs) {
    Vector6 change;
    for (int k = 0; k < 6; ++k) change[k] = (signs >> k) & 1 ? 1 : -1;
    const Vector6 twist = inverse * change;
    if (w.cols() > 6 && (w.transpose() * twist).cwiseAbs().maxCoeff() > 1 + 1e-9) continue;
    result->translation_each = std::max(result->translation_each, twist.head<3>().norm());
    result->rotation_each = std::max(result->rotation_each, twist.tail<3>().norm());
  }
}

}  // namespace

Sensitivity sensitivity(const Mechanism& mechanism, const Pose& world_from_platform) {
  WrenchMatrix w = wrench_matrix(mechanism, world_from_platform);
  const double length = characteristic_length(mechanism);
  w.bottomRows<3>() /= length;
  const Eigen::Index n = w.cols();
  Sensitivity result;
  const Matrix6 square = w * w.transpose();
  if (n < 6 || !(Eigen::JacobiSVD<WrenchMatrix>(w).singularValues()[5] > kRank)) {
    const double infinite = std::numeric_limits<double>::infinity();
    return {infinite, infinite, infinite, infinite};
  }
  const Matrix6 inverse = square.fullPivLu().inverse();
  const auto largest = [](const Eigen::Matrix3d& block) {
    return std::sqrt(internal::symmetric_axes(block).values[2]);
  };
  result.translation_joint = largest(inverse.topLeftCorner<3, 3>());
  result.rotation_joint = largest(inverse.bottomRightCorner<3, 3>());
  std::array<int, 6> chosen{0, 1, 2, 3, 4, 5};
  for (;;) {  // every six of n in turn
    look_at_vertices(w, chosen, &result);
    int k = 5;
    while (k >= 0 && chosen[std::size_t(k)] == int(n) - 6 + k) --k;
    if (k < 0) break;
    ++chosen[std::size_t(k)];
    for (int i = k + 1; i < 6; ++i) chosen[std::size_t(i)] = chosen[std::size_t(i - 1)] + 1;
  }
  // A turn ω was counted as the way length ω.
  result.rotation_each /= length, result.rotation_joint /= length;
  return result;
}

}  // namespace lumihull::capture
