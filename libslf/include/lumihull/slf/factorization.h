#pragma once

#include <lumihull/base/api.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lumihull::slf {

/// A matrix as a product of few terms: A ≈ surface * view. A row of A is a surface point (in one colour channel), a
/// column is a view: A is n x m. Made by the functions below, which are pure, run on the caller's thread, and give the
/// same bytes for the same input and seed. All of them throw Error{invalid_argument} for an empty matrix, a sample that
/// is not finite or beyond 1e30, matrices that do not fit each other, and terms outside 1 … kMaxFactors.
struct Factors {
  Eigen::MatrixXf surface;  ///< n x K; terms fall in energy, the scale is here
  Eigen::MatrixXf view;     ///< K x m; rows of unit length, or zero where the matrix needs no more terms
};

inline constexpr int kMaxFactors = 64;

/// The K terms nearest to A (n x m) in the Frobenius norm: its truncated singular value decomposition, factored as in
/// Chen, Bouguet, Chu & Grzeszczuk 2002, "Light Field Mapping" (power iteration on a Gram matrix, signed). Here it is
/// the smaller Gram matrix, and a block of vectors at once, so that equal singular values do no harm: where the K-th
/// and the next are nearly equal the terms are as good as any, not unique. The rows of `view` are orthonormal, the
/// largest entry of each is positive; terms below 1e-7 of the first (what float leaves of zero) are zero, as are those
/// beyond min(n, m). `seed`: of the starting vectors.
LUMIHULL_API Factors pca(const Eigen::Ref<const Eigen::MatrixXf>& a, int terms, std::uint64_t seed);

struct NmfOptions {
  int iterations = 200;     ///< at most; >= 0
  double tolerance = 1e-5;  ///< stop where an iteration takes less than this share off the loss; >= 0
  /// n x m, >= 0: trust in each sample, 0 = missing (its value is not looked at). None: all are 1. Borrowed.
  const Eigen::MatrixXf* weights = nullptr;
};

/// Non-negative factors of a non-negative matrix: minimises Σ w (a - g h)² by the multiplicative updates of Lee & Seung
/// 2001, "Algorithms for non-negative matrix factorization" (least-squares form), with weights inside both fractions:
///   g ← g ((w a) hᵀ) / ((w (g h)) hᵀ), h ← h (gᵀ (w a)) / (gᵀ (w (g h))).
/// Finds a local minimum, which depends on `seed`. Rows and columns without samples get zero. `loss`: the weighted sum
/// of squares before the first and after each iteration; it never rises (beyond rounding). Errors besides those of
/// Factors: a negative sample or weight.
LUMIHULL_API Factors nmf(const Eigen::Ref<const Eigen::MatrixXf>& a, int terms, const NmfOptions& options,
                         std::uint64_t seed, std::vector<double>* loss = nullptr);

struct LowRankOptions {
  double ridge = 1e-3;      ///< pull of the terms towards zero, against the size of the whole; >= 0
  int iterations = 30;      ///< of the final Gauss-Newton, at most; >= 0
  double tolerance = 1e-5;  ///< stop where an iteration takes less than this share off the loss; >= 0
  /// m x m, symmetric, positive semidefinite, e.g. the Laplacian of a graph over neighbouring views. Borrowed.
  const Eigen::MatrixXf* smoothness = nullptr;
  double strength = 0;  ///< of the smoothness, against a sample of mean weight; >= 0
};

/// Factors of the samples that exist. With X = G H (n x K, K x m), minimises
///   Σ w (a - x)²  +  ridge ω σ (|G|² + |H|²)  +  strength ω Σ_i x_i L x_iᵀ,    x_i = row i of X,
/// where ω is the mean of the positive weights and σ² = n m (weighted mean of a²) what the whole matrix's squared norm
/// would be: only ratios of weights and of samples matter. The ridge takes as much off each singular value of X (it is
/// 2 ridge ω σ times their sum, where G and H are balanced: Srebro, Rennie & Jaakkola 2004), a share of about
/// ridge / fill off the first; the smoothness L bears on the product, so that no scale can escape into G.
/// `weights`: n x m, >= 0, 0 = missing (the value is not looked at, it may be NaN).
///
/// Terms are added one by one, each from the strongest direction of the residual's gradient, and none once the samples
/// are met to float precision; surface factors are eliminated (variable projection: Golub & Pereyra 1973; for this
/// problem Wiberg 1976, see Okatani & Deguchi 2007; Kaufman's 1975 Jacobian), and the view factor takes damped
/// Gauss-Newton steps. A local minimum, in practice the global one where samples are plenty; a row of A with fewer
/// samples than terms is not determined by them, and gets the smallest factors that fit (a ridge below 1e-10 counts as
/// 1e-10). Rows and columns without samples get zero; with smoothness, a column gets what its neighbours say.
/// The rows of `view` are orthonormal and signed as in `pca`. Errors besides those of Factors: a negative weight, a
/// smoothness that is not symmetric and positive semidefinite, options outside their ranges.
LUMIHULL_API Factors low_rank(const Eigen::Ref<const Eigen::MatrixXf>& a,
                              const Eigen::Ref<const Eigen::MatrixXf>& weights, int terms,
                              const LowRankOptions& options, std::uint64_t seed);

}  // namespace lumihull::slf
