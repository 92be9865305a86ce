// What the three factorisations share: checks, the random start, and the form in which factors are handed out.
#pragma once

#include <lumihull/base/error.h>
#include <lumihull/slf/factorization.h>

#include <string>

namespace lumihull::slf::factor {

inline constexpr float kLargestSample = 1e30f;

using Matrix = Eigen::Ref<const Eigen::MatrixXf>;

[[noreturn]] inline void fail(const std::string& message) { throw Error(ErrorCode::invalid_argument, message); }

void require_matrix(const Matrix& a);
void require_terms(int terms);
/// n x m, finite, >= 0.
void require_weights(const Matrix& weights, const Matrix& a);
void require_number(double value, const char* name);  ///< finite, >= 0
/// Finite, and of a size whose norm a float can hold.
void require_sample(float value);
/// A double copy of `a` in which the samples of weight 0 are 0.
Eigen::MatrixXd samples(const Matrix& a, const Matrix& weights);

/// Uniform in [0, 1) (Steele, Lea & Flood 2014, SplitMix64).
double uniform(std::uint64_t& state);

/// Makes the columns from `first` on orthonormal to each other and to those before, which are so already; a column that
/// the others span becomes 0. Gram-Schmidt, twice (Giraud, Langou & Rozložník 2005).
void orthonormalize(Eigen::MatrixXd& columns, Eigen::Index first = 0);

/// surface: n x K, view: m x K. Terms of a zero view are zero; the largest entry of each view is positive.
Factors signed_factors(Eigen::MatrixXd surface, Eigen::MatrixXd view);

}  // namespace lumihull::slf::factor
