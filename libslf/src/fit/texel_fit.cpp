#include "texel_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace lumihull::slf {

TexelFit::TexelFit(std::size_t terms, double ridge, std::span<const float> shares)
    : n_(terms + 1),
      packed_(n_ * (n_ + 1) / 2),
      ridge_(float(ridge)),
      shares_(Eigen::VectorXf::Ones(std::ptrdiff_t(n_))),
      phi_(n_),
      system_(n_, n_),
      rhs_(n_, 3),
      colors_(n_, 3) {
  for (std::size_t k = 0; k < shares.size(); ++k) shares_[std::ptrdiff_t(k + 1)] = shares[k];
}

void TexelFit::clear(std::size_t texels) {
  normal_.assign(texels * packed_, 0);
  right_.assign(texels * n_ * 3, 0);
  squares_.assign(texels, 0);
}

void TexelFit::solve(std::size_t texel, float* mean, float* surface) {
  const float* at = &normal_[texel * packed_];
  const float weight = at[0];
  left_ = left_by_mean_ = 0;
  if (weight == 0) {
    std::fill_n(mean, 3, 0.0f);
    std::fill_n(surface, (n_ - 1) * 3, 0.0f);
    return;
  }
  const auto n = std::ptrdiff_t(n_);
  for (std::ptrdiff_t k = 0; k < n; ++k)
    for (std::ptrdiff_t l = 0; l <= k; ++l) system_(k, l) = *at++;
  const float ridge = ridge_ * weight;
  system_.diagonal().tail(n - 1).array() += ridge;
  for (std::ptrdiff_t k = 0; k < n; ++k)
    for (std::ptrdiff_t ch = 0; ch < 3; ++ch) rhs_(k, ch) = right_[(texel * n_ + std::size_t(k)) * 3 + std::size_t(ch)];
  colors_ = rhs_;
  for (std::ptrdiff_t k = 1; k < n; ++k)
    if (shares_[k] == 0) {  // the others are fitted without it
      system_.row(k).setZero();
      system_.col(k).setZero();
      system_(k, k) = 1;
      colors_.row(k).setZero();
    }
  system_.selfadjointView<Eigen::Lower>().llt().solveInPlace(colors_);
  colors_ = shares_.asDiagonal() * colors_;
  for (std::ptrdiff_t ch = 0; ch < 3; ++ch) {
    mean[ch] = colors_(0, ch);
    for (std::ptrdiff_t k = 1; k < n; ++k) surface[(k - 1) * 3 + ch] = colors_(k, ch);
  }
  // |c - φx|² = |c|² - 2 x·r + x·N x, N being the system without its ridge.
  left_ = squares_[texel] - 2 * double(colors_.cwiseProduct(rhs_).sum()) +
          double(colors_.cwiseProduct(system_.selfadjointView<Eigen::Lower>() * colors_).sum()) -
          double(ridge) * double(colors_.bottomRows(n - 1).squaredNorm());
  left_ = std::max(0.0, left_);
  left_by_mean_ = std::max(0.0, double(squares_[texel]) - double(rhs_.row(0).squaredNorm()) / double(weight));
}

}  // namespace lumihull::slf
