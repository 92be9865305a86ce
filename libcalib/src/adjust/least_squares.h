#pragma once

// What the solver knows of a problem: blocks of unknowns, and terms that touch a few of them each.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::calib::bundle {

inline constexpr int kTermBlocks = 5;    ///< most that a term touches
inline constexpr int kTermRows = 3;      ///< most residuals of a term
inline constexpr int kTermColumns = 36;  ///< most unknowns that a term touches

/// A few residuals that belong together: one observation, one scale bar.
struct Term {
  std::array<std::int32_t, kTermBlocks> block{-1, -1, -1, -1, -1};  ///< different ones; the first `blocks` are used
  std::uint8_t blocks = 0;
  std::uint8_t rows = 2;
};

/// A problem of least squares: a state, changed by small steps. The cost is Σ over the terms of r², or of a robust
/// loss.
class LeastSquares {
 public:
  virtual ~LeastSquares() = default;

  /// Numbers of unknowns of each block; a step is a vector of all of them in this order.
  std::vector<int> sizes;
  /// Blocks that are eliminated first. No term touches two of them.
  std::vector<char> eliminated;
  std::vector<Term> terms;
  /// Share of the cost that approximate derivatives may leave on the table: a step that loses no more is the end.
  double neglected = 0;

  /// A term at the state last moved to; may be called from several threads. Returns its cost, >= 0; anything else: it
  /// can't be evaluated there. jacobian, if wanted: term.rows x (columns of the term's blocks, in the term's order),
  /// row-major; under a robust loss residual and jacobian are weighted, such that jacobianᵀ residual is half the
  /// cost's gradient.
  virtual double evaluate(std::size_t term, double* residual, double* jacobian) const = 0;

  /// Moves to the kept state changed by a step; false where there is no such state.
  virtual bool move(const Eigen::VectorXd& step) = 0;
  /// Keeps the state moved to.
  virtual void keep() = 0;

  /// Directions at the kept state that change no residual (n x 6 or 7 in bundle adjustment), linearly independent.
  virtual Eigen::MatrixXd gauge() const = 0;
};

}  // namespace lumihull::calib::bundle
