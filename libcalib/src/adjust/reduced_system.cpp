// Elimination, solution and covariances of the normal equations.
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <atomic>

#include "normal_equations.h"

namespace lumihull::calib::bundle {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Square = Eigen::Map<const MatrixXd>;

/// out (columns `stride` apart) = L⁻¹ in, both `size` x `columns`, column-major.
template <int kSize>
void forward_substitute(const double* l, Index size, const double* in, Index columns, double* out, Index stride) {
  const Index n = kSize > 0 ? kSize : size;
  for (Index c = 0; c < columns; ++c, in += n, out += stride)
    for (Index i = 0; i < n; ++i) {
      double sum = in[i];
      for (Index j = 0; j < i; ++j) sum -= l[j * n + i] * out[j];
      out[i] = sum / l[i * n + i];
    }
}

void forward_substitute(const double* l, Index size, const double* in, Index columns, double* out, Index stride) {
  switch (size) {
    case 3:
      return forward_substitute<3>(l, size, in, columns, out, stride);
    case 6:
      return forward_substitute<6>(l, size, in, columns, out, stride);
    default:
      return forward_substitute<0>(l, size, in, columns, out, stride);
  }
}

/// Orthonormal columns of the same span; columns that depend on earlier ones are left out.
MatrixXd orthonormal(const MatrixXd& a) {
  MatrixXd q(a.rows(), a.cols());
  Index rank = 0;
  for (Index i = 0; i < a.cols(); ++i) {
    VectorXd v = a.col(i);
    const double length = v.norm();
    for (int pass = 0; pass < 2; ++pass) v -= q.leftCols(rank) * (q.leftCols(rank).transpose() * v);
    if (v.norm() > 1e-9 * length) q.col(rank++) = v.normalized();
  }
  return q.leftCols(rank);
}

}  // namespace

/// L of each eliminated block, and Y. false: a block is not positive definite.
bool NormalEquations::eliminate(double lambda, Job& job) {
  std::atomic<bool> failed{false};
  parallel_for(job, panels_.size(), [&](std::size_t p) {
    const Panel& panel = panels_[p];
    for (std::size_t i = panel.first; i < panel.last; ++i) {
      const Eliminated& e = eliminated_[i];
      Eigen::Map<MatrixXd> l(factors_.data() + e.u, e.size, e.size);
      l = Square(u_.data() + e.u, e.size, e.size);
      l.diagonal() += lambda * diagonal_.segment(offset_[e.block], e.size);
      for (Index k = 0; k < e.size; ++k)
        if (!(l(k, k) > 0)) l(k, k) = 1;  // nothing depends on this unknown
      Eigen::LLT<Eigen::Ref<MatrixXd>> llt(l);
      if (llt.info() != Eigen::Success || !l.diagonal().allFinite()) {
        failed = true;
        return;
      }
      for (std::size_t m = e.first; m < e.last; ++m) {
        const auto k = std::size_t(met_[m].block);
        const std::size_t column = tile_of_kept_[k];
        double* out =
            y_.data() + panel.tile[column] + (kept_column_[k] - tiles_[column]) * panel.rows + e.row - panel.row;
        forward_substitute(l.data(), e.size, w_.data() + e.w + std::size_t(met_[m].column * e.size), sizes_[k], out,
                           panel.rows);
      }
    }
  });
  return !failed;
}

/// V + λ diag(V), added to the reduced system's lower triangle.
void NormalEquations::add_kept(double lambda) {
  for (const std::size_t b : kept_blocks_) {
    const Index at = kept_column_[b], size = sizes_[b];
    auto block = reduced_.block(at, at, size, size);
    block.triangularView<Eigen::Lower>() += Square(kept_values_.data() + kept_diagonal_[b], size, size);
    for (Index i = 0; i < size; ++i) {
      const double d = diagonal_[offset_[b] + i];
      block(i, i) += lambda * d;
      if (kept_values_[kept_diagonal_[b] + std::size_t(i * (size + 1))] <= 0) block(i, i) += d;
    }
  }
  // The pair's block is row-major with the lower index first: column-major it is the transposed one, below the
  // diagonal.
  for (const KeptPair& pair : kept_pairs_) {
    const auto a = std::size_t(pair.a), b = std::size_t(pair.b);
    reduced_.block(kept_column_[b], kept_column_[a], sizes_[b], sizes_[a]) +=
        Square(kept_values_.data() + pair.value, sizes_[b], sizes_[a]);
  }
}

std::optional<std::size_t> NormalEquations::factorize(double lambda, const MatrixXd& gauge, double least_share,
                                                      Job& job) {
  MatrixXd scaled(kept_size_, gauge.cols());
  VectorXd root(kept_size_);
  for (const std::size_t b : kept_blocks_) {
    scaled.middleRows(kept_column_[b], sizes_[b]) = gauge.middleRows(offset_[b], sizes_[b]);
    root.segment(kept_column_[b], sizes_[b]) = diagonal_.segment(offset_[b], sizes_[b]).cwiseSqrt();
  }
  held_ = root.asDiagonal() * orthonormal(root.asDiagonal() * scaled);

  if (!eliminate(lambda, job)) {
    for (const Eliminated& e : eliminated_)
      if (diagonal_block(e.block).llt().info() != Eigen::Success) return e.block;
    return eliminated_.front().block;
  }
  reduced_.resize(kept_size_, kept_size_);
  const std::size_t count = tiles_.size() - 1;
  parallel_for(job, count * (count + 1) / 2, [&](std::size_t pair) {
    std::size_t i = 0;
    while ((i + 1) * (i + 2) / 2 <= pair) ++i;
    const std::size_t j = pair - i * (i + 1) / 2;
    auto block = reduced_.block(tiles_[i], tiles_[j], tiles_[i + 1] - tiles_[i], tiles_[j + 1] - tiles_[j]);
    block.noalias() = held_.middleRows(tiles_[i], block.rows()) * held_.middleRows(tiles_[j], block.cols()).transpose();
    for (const Panel& panel : panels_)
      if (panel.tile[i] >= 0 && panel.tile[j] >= 0) block.noalias() -= tile(panel, i).transpose() * tile(panel, j);
  });
  add_kept(lambda);
  const auto bad = bundle::factorize(reduced_, tiles_, least_share * root.cwiseAbs2(), job);
  if (!bad) return std::nullopt;
  for (const std::size_t b : kept_blocks_)
    if (*bad < kept_column_[b] + sizes_[b]) return b;
  return std::nullopt;
}

MatrixXd NormalEquations::solve(const MatrixXd& right, Job& job) const {
  MatrixXd z(eliminated_size_, right.cols()), kept(kept_size_, right.cols());
  for (const Eliminated& e : eliminated_)
    z.middleRows(e.row, e.size) = Square(factors_.data() + e.u, e.size, e.size)
                                      .triangularView<Eigen::Lower>()
                                      .solve(right.middleRows(offset_[e.block], e.size));
  for (const std::size_t b : kept_blocks_)
    kept.middleRows(kept_column_[b], sizes_[b]) = right.middleRows(offset_[b], sizes_[b]);
  parallel_for(job, tiles_.size() - 1, [&](std::size_t c) {
    for (const Panel& panel : panels_)
      if (panel.tile[c] >= 0)
        kept.middleRows(tiles_[c], tiles_[c + 1] - tiles_[c]).noalias() -=
            tile(panel, c).transpose() * z.middleRows(panel.row, panel.rows);
  });
  const auto lower = reduced_.triangularView<Eigen::Lower>();
  lower.solveInPlace(kept);
  lower.transpose().solveInPlace(kept);

  MatrixXd x(unknowns_, right.cols());
  for (const std::size_t b : kept_blocks_)
    x.middleRows(offset_[b], sizes_[b]) = kept.middleRows(kept_column_[b], sizes_[b]);
  parallel_for(job, panels_.size(), [&](std::size_t p) {
    const Panel& panel = panels_[p];
    MatrixXd rest = z.middleRows(panel.row, panel.rows);
    for (std::size_t c = 0; c + 1 < tiles_.size(); ++c)
      if (panel.tile[c] >= 0) rest.noalias() -= tile(panel, c) * kept.middleRows(tiles_[c], tiles_[c + 1] - tiles_[c]);
    for (std::size_t i = panel.first; i < panel.last; ++i) {
      const Eliminated& e = eliminated_[i];
      x.middleRows(offset_[e.block], e.size) = Square(factors_.data() + e.u, e.size, e.size)
                                                   .transpose()
                                                   .triangularView<Eigen::Upper>()
                                                   .solve(rest.middleRows(e.row - panel.row, e.size));
    }
  });
  return x;
}

VectorXd NormalEquations::along_gauge(const VectorXd& step) const {
  VectorXd kept(kept_size_);
  for (const std::size_t b : kept_blocks_)
    kept.segment(kept_column_[b], sizes_[b]) = step.segment(offset_[b], sizes_[b]);
  return held_.transpose() * kept;
}

BlockCovariances NormalEquations::covariances(const MatrixXd& gauge, const MatrixXd& datum,
                                              const std::vector<char>& wanted, int joint, Job& job) const {
  BlockCovariances result;
  result.of.resize(sizes_.size()), result.with.resize(sizes_.size());
  const auto lower = reduced_.triangularView<Eigen::Lower>();
  // (LLᵀ)⁻¹ = XᵀX with X = L⁻¹; of it only columns that are asked for.
  MatrixXd joint_columns;
  if (joint >= 0) {
    const Index size = sizes_[std::size_t(joint)];
    joint_columns.setZero(kept_size_, size);
    joint_columns.middleRows(kept_column_[std::size_t(joint)], size).setIdentity();
    lower.solveInPlace(joint_columns);
  }
  const auto below = [&](Index begin) {
    return reduced_.bottomRightCorner(kept_size_ - begin, kept_size_ - begin).triangularView<Eigen::Lower>();
  };
  parallel_for(job, tiles_.size() - 1, [&](std::size_t c) {
    const Index begin = tiles_[c], rows = kept_size_ - begin, width = tiles_[c + 1] - begin;
    MatrixXd x;
    for (const std::size_t b : kept_blocks_) {
      if (tile_of_kept_[b] != c || !wanted[b]) continue;
      if (x.size() == 0) {
        x.setIdentity(rows, width);
        below(begin).solveInPlace(x);
      }
      const auto own = x.middleCols(kept_column_[b] - begin, sizes_[b]);
      result.of[b] = own.transpose() * own;
      if (joint >= 0) result.with[b] = own.transpose() * joint_columns.bottomRows(rows);
    }
  });
  // Q_ee = L⁻ᵀ (I + TᵀT) L⁻¹ with T = (S's factor)⁻¹ Yᵀ.
  parallel_for(job, panels_.size(), [&](std::size_t p) {
    const Panel& panel = panels_[p];
    std::size_t first = 0;
    while (first + 1 < tiles_.size() && panel.tile[first] < 0) ++first;
    MatrixXd t;
    bool ready = false;
    for (std::size_t i = panel.first; i < panel.last; ++i) {
      const Eliminated& e = eliminated_[i];
      if (!wanted[e.block]) continue;
      const Index begin = tiles_[first];
      if (!ready) {
        ready = true;
        t.setZero(kept_size_ - begin, panel.rows);
        for (std::size_t c = first; c + 1 < tiles_.size(); ++c)
          if (panel.tile[c] >= 0)
            t.middleRows(tiles_[c] - begin, tiles_[c + 1] - tiles_[c]) = tile(panel, c).transpose();
        below(begin).solveInPlace(t);
      }
      const auto own = t.middleCols(e.row - panel.row, e.size);
      const Square l(factors_.data() + e.u, e.size, e.size);
      const auto upper = l.transpose().triangularView<Eigen::Upper>();
      MatrixXd inner = MatrixXd::Identity(e.size, e.size);
      inner.noalias() += own.transpose() * own;
      const MatrixXd half = upper.solve(inner);
      result.of[e.block] = upper.solve(half.transpose());
      if (joint >= 0) result.with[e.block] = -upper.solve(own.transpose() * joint_columns.bottomRows(t.rows()));
    }
  });
  if (gauge.cols() == 0) return result;

  const MatrixXd a = solve(datum, job);  // Q B
  const Eigen::PartialPivLU<MatrixXd> fixed(datum.transpose() * gauge);
  const MatrixXd along = fixed.solve(a.transpose()).transpose();  // Q B (BᵀG)⁻ᵀ
  const MatrixXd center = fixed.solve(datum.transpose() * along);
  const auto shifted = [&](MatrixXd& q, std::size_t x, std::size_t y) {
    const auto gx = gauge.middleRows(offset_[x], sizes_[x]), gy = gauge.middleRows(offset_[y], sizes_[y]);
    const auto ax = along.middleRows(offset_[x], sizes_[x]), ay = along.middleRows(offset_[y], sizes_[y]);
    q += gx * center * gy.transpose() - gx * ay.transpose() - ax * gy.transpose();
  };
  for (std::size_t b = 0; b < sizes_.size(); ++b) {
    if (!wanted[b]) continue;
    shifted(result.of[b], b, b);
    result.of[b] = (0.5 * (result.of[b] + result.of[b].transpose())).eval();
    if (joint >= 0) shifted(result.with[b], b, std::size_t(joint));
  }
  return result;
}

}  // namespace lumihull::calib::bundle
