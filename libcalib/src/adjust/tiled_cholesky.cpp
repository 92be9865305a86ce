#include "tiled_cholesky.h"

#include <lumihull/base/parallel.h>

namespace lumihull::calib::bundle {
namespace {

/// One tile on the diagonal, row by row.
std::optional<Eigen::Index> factorize_tile(Eigen::Ref<Eigen::MatrixXd> a,
                                           const Eigen::Ref<const Eigen::VectorXd>& least) {
  const Eigen::Index n = a.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double pivot = a(k, k) - a.row(k).head(k).squaredNorm();
    if (!(pivot > least[k]) || !(pivot > 0)) return k;
    const Eigen::Index below = n - k - 1;
    a(k, k) = std::sqrt(pivot);
    if (k > 0) a.col(k).tail(below).noalias() -= a.bottomLeftCorner(below, k) * a.row(k).head(k).transpose();
    a.col(k).tail(below) /= a(k, k);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Index> factorize(Eigen::MatrixXd& a, const Tiles& tiles, const Eigen::VectorXd& least, Job& job) {
  const std::size_t count = tiles.size() - 1;
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Index begin = tiles[k], width = tiles[k + 1] - begin;
    const auto tile = [&](std::size_t i) { return a.block(tiles[i], begin, tiles[i + 1] - tiles[i], width); };
    if (k > 0)
      parallel_for(job, count - k, [&](std::size_t i) {
        auto target = tile(k + i);
        target.noalias() -=
            a.block(tiles[k + i], 0, target.rows(), begin) * a.block(begin, 0, width, begin).transpose();
      });
    const auto bad = factorize_tile(tile(k), least.segment(begin, width));
    if (bad) return begin + *bad;
    const auto corner = tile(k);
    parallel_for(job, count - k - 1, [&](std::size_t i) {
      auto target = tile(k + 1 + i);
      corner.template triangularView<Eigen::Lower>().transpose().template solveInPlace<Eigen::OnTheRight>(target);
    });
  }
  return std::nullopt;
}

}  // namespace lumihull::calib::bundle
