#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace lumihull::slf {

/// Mean colour and surface maps of a block's texels: ridge regression of the samples' colours on the view maps' values,
/// each texel by itself, exactly.
class TexelFit {
 public:
  /// ridge: pulls surface maps, not the mean, towards 0, in shares of a texel's weight. shares: what solve keeps of
  /// each term, 0 … 1; empty: all. A term of which nothing is kept has no part in the fit of the others.
  TexelFit(std::size_t terms, double ridge, std::span<const float> shares = {});

  void clear(std::size_t texels);

  /// A sample: its weight > 0, colour and the values of the terms' view maps.
  void add(std::size_t texel, float weight, const std::array<float, 3>& color, std::span<const float> view) {
    phi_[0] = 1;
    for (std::size_t k = 0; k < view.size(); ++k) phi_[k + 1] = view[k];
    float* at = &normal_[texel * packed_];
    float* rhs = &right_[texel * n_ * 3];
    for (std::size_t k = 0; k < n_; ++k) {
      const float wk = weight * phi_[k];
      for (std::size_t l = 0; l <= k; ++l) *at++ += wk * phi_[l];
      for (std::size_t ch = 0; ch < 3; ++ch) *rhs++ += wk * color[ch];
    }
    squares_[texel] += weight * (color[0] * color[0] + color[1] * color[1] + color[2] * color[2]);
  }

  /// Sum of the weights of a texel's samples.
  float weight(std::size_t texel) const { return normal_[texel * packed_]; }

  /// mean: 3 values; surface: terms x 3. All 0 where the weight is.
  void solve(std::size_t texel, float* mean, float* surface);

  /// Weighted sums of squares of what solve, called just before, leaves of a texel's samples, and what the mean colour
  /// alone would leave.
  double left() const { return left_; }
  double left_by_mean() const { return left_by_mean_; }

 private:
  std::size_t n_, packed_;
  float ridge_;
  Eigen::VectorXf shares_;  // of the mean and the terms
  double left_ = 0, left_by_mean_ = 0;
  std::vector<float> phi_, normal_, right_, squares_;
  Eigen::MatrixXf system_, rhs_, colors_;
};

}  // namespace lumihull::slf
