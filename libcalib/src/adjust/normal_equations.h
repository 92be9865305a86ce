#pragma once

// The normal equations of a LeastSquares: H = Σ JᵀJ in blocks, eliminated to a dense reduced system. Exported for
// tests.

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <optional>

#include "least_squares.h"
#include "tiled_cholesky.h"

namespace lumihull::calib::bundle {

/// Parts of (H)⁻¹ in a datum.
struct BlockCovariances {
  std::vector<Eigen::MatrixXd> of;    ///< each block, d x d; empty where not wanted
  std::vector<Eigen::MatrixXd> with;  ///< each wanted block with the joint one, d x d_joint
};

/// With E the eliminated blocks, K the others (Triggs et al. 2000, section 6.1):
///
///     H = [U W; Wᵀ V],  U = blockdiag(L Lᵀ),  Y = L⁻¹ W,  S = V - YᵀY,  S dense
///
/// W is stored by eliminated block, for the blocks that meet in a term. Y is stored as dense tiles of about 256 x 192;
/// tiles without any such pair are left out, so S costs what visibility needs. All sums are over fixed parts in a fixed
/// order: the same bytes for any number of threads.
class LUMIHULL_API NormalEquations {
 public:
  /// Sizes, eliminated and terms of `problem` stay as they are as long as this lives.
  explicit NormalEquations(const LeastSquares& problem);

  Eigen::Index unknowns() const { return unknowns_; }
  Eigen::Index reduced_size() const { return kept_size_; }
  Eigen::Index offset(std::size_t block) const { return offset_[block]; }  ///< in a step

  /// Σ cost of all terms at the state moved to; nothing where one can't be evaluated.
  std::optional<double> cost(const LeastSquares& problem, Job& job) const;
  /// The same, and H and Jᵀr.
  std::optional<double> linearize(const LeastSquares& problem, Job& job);

  /// A block of H on the diagonal, d x d.
  Eigen::MatrixXd diagonal_block(std::size_t block) const;
  const Eigen::VectorXd& gradient() const { return gradient_; }  ///< Jᵀr
  const Eigen::VectorXd& diagonal() const { return diagonal_; }  ///< of H, ones for zeros

  /// Factors H + λ diag(H) + M Mᵀ, where M spans the gauge within the kept blocks, scaled by diag(H): what the gauge
  /// leaves singular becomes regular, and a solution of equations that the gauge does not touch stays one. Returns the
  /// block at which it is not positive definite (a pivot of S not above `least_share` of H's diagonal).
  std::optional<std::size_t> factorize(double lambda, const Eigen::MatrixXd& gauge, double least_share, Job& job);
  /// (That matrix)⁻¹ right.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right, Job& job) const;
  /// Mᵀ step.
  Eigen::VectorXd along_gauge(const Eigen::VectorXd& step) const;

  /// Parts of P H⁻ Pᵀ with P = I - G (BᵀG)⁻¹ Bᵀ: the covariance in the datum Bᵀx = 0 (S-transformation, Baarda 1973).
  /// After factorize(0, gauge, …). wanted: a block each; joint: a kept block, or -1.
  BlockCovariances covariances(const Eigen::MatrixXd& gauge, const Eigen::MatrixXd& datum,
                               const std::vector<char>& wanted, int joint, Job& job) const;

 private:
  struct Eliminated {
    std::size_t block = 0;
    Eigen::Index size = 0, row = 0;   ///< row: among the eliminated unknowns
    std::size_t u = 0, w = 0;         ///< where its values begin
    std::size_t first = 0, last = 0;  ///< in met_
    std::size_t panel = 0;
  };
  struct Met {  ///< a kept block that an eliminated one meets
    std::int32_t block = 0;
    std::int32_t column = 0;  ///< among the kept unknowns that it meets
  };
  struct KeptPair {
    std::int32_t a = 0, b = 0;
    std::size_t value = 0;  ///< d_a x d_b, row-major, in kept_values_
  };
  struct Part {  ///< terms first … last of order_, and the eliminated blocks that they alone touch
    std::size_t first = 0, last = 0, first_eliminated = 0, last_eliminated = 0;
  };
  struct Panel {  ///< eliminated blocks whose rows make up tiles of Y
    std::size_t first = 0, last = 0;
    Eigen::Index row = 0, rows = 0;
    std::vector<std::ptrdiff_t> tile;  ///< by kept tile: where its values begin in y_; -1: nothing there
  };
  using TileMap = Eigen::Map<const Eigen::MatrixXd>;

  void lay_out(const LeastSquares& problem);
  void find_pairs(const LeastSquares& problem);
  void lay_out_tiles();
  void add_term(const LeastSquares& problem, std::size_t term, const double* residual, const double* jacobian,
                double* kept_values, double* kept_gradient);
  TileMap tile(const Panel& panel, std::size_t column) const {
    return {y_.data() + panel.tile[column], panel.rows, tiles_[column + 1] - tiles_[column]};
  }
  bool eliminate(double lambda, Job& job);
  void add_kept(double lambda);

  std::vector<int> sizes_;
  std::vector<std::int32_t> eliminated_index_;  ///< by block; -1: kept
  std::vector<Eigen::Index> offset_, kept_column_;
  std::vector<std::size_t> kept_blocks_, kept_diagonal_;  ///< kept_diagonal_: by block, in kept_values_
  Eigen::Index unknowns_ = 0, kept_size_ = 0, eliminated_size_ = 0;
  std::vector<Eliminated> eliminated_;
  std::vector<Met> met_;
  std::vector<KeptPair> kept_pairs_;
  std::vector<std::uint32_t> order_;  ///< terms, by the eliminated block that they touch
  std::vector<std::uint32_t> slots_;  ///< of each term's pairs (a < b): where their values begin
  std::vector<std::size_t> slots_begin_;
  std::vector<Part> parts_;

  std::vector<double> u_, w_, kept_values_, partial_;
  Eigen::VectorXd gradient_, diagonal_;

  Tiles tiles_;
  std::vector<std::size_t> tile_of_kept_;  ///< by block
  std::vector<Panel> panels_;
  std::vector<double> y_, factors_;  ///< factors_: L of each eliminated block, like u_
  Eigen::MatrixXd reduced_;          ///< S, then its factor
  Eigen::MatrixXd held_;             ///< M
};

}  // namespace lumihull::calib::bundle
