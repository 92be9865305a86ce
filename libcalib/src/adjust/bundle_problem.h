#pragma once

// Bundle adjustment as a LeastSquares. Exported for tests.

#include <lumihull/calib/adjustment.h>

#include "lean_lens.h"
#include "least_squares.h"

namespace lumihull::calib::bundle {

/// Blocks, in this order: shots; bodies, or points of free bodies; cameras' intrinsics; cameras on the rig; print
/// scale. A shot is changed by a small motion (rotation vector, translation) after rig_from_world, a camera on the rig
/// by one after cam_from_rig, a body by one in the world about its middle (and a, b, c), a free point by a shift.
class LUMIHULL_API BundleProblem final : public LeastSquares {
 public:
  /// start: checked (adjust_checks.h), lives as long as this. Observations that can't be predicted at the start do not
  /// count.
  BundleProblem(const Adjustment& start, const AdjustOptions& options);

  double evaluate(std::size_t term, double* residual, double* jacobian) const override;
  bool move(const Eigen::VectorXd& step) override;
  void keep() override { kept_ = moved_; }
  Eigen::MatrixXd gauge() const override;

  /// B of the datum (NormalEquations::covariances): Bᵀx = 0 where the bodies' points are neither shifted nor turned
  /// nor, if scale_is_free, scaled by x about their mean.
  Eigen::MatrixXd datum() const;
  bool scale_is_free() const { return scale_is_free_; }
  /// Keeps and moves to the state turned, shifted and, if scale_is_free, scaled back to where the bodies' points were
  /// at the start (Umeyama 1991). No residual changes.
  void align();

  /// The kept state; observations and bars as at the start.
  Adjustment adjusted() const;
  /// Measured less predicted, at the state moved to; not a number where it can't be predicted.
  Eigen::Vector2d residual(std::size_t observation) const;
  bool counts(std::size_t observation) const { return counts_[observation] != 0; }
  /// Whitened squares of all terms, without a robust loss, at the state moved to.
  double chi2() const;
  std::int64_t redundancy() const;
  /// d (point in the world) / d (its body's block), and / d (print scale), at the kept state.
  void point_jacobian(std::size_t body, std::size_t point, Eigen::Matrix<double, 3, Eigen::Dynamic>& by_block,
                      Eigen::Matrix<double, 3, 2>& by_print) const;

  std::size_t shot_block(std::size_t shot) const { return shot; }
  /// -1: a free body's point that is not observed.
  int body_block(std::size_t body, std::size_t point) const { return blocks_of_points_[first_point_[body] + point]; }
  int camera_block(std::size_t camera) const { return camera_blocks_[camera]; }  ///< -1: all fixed
  int rig_block(std::size_t camera) const { return rig_blocks_[camera]; }        ///< -1: fixed
  int print_block() const { return print_block_; }                               ///< -1: fixed
  const std::vector<int>& free_intrinsics(std::size_t camera) const { return free_intrinsics_[camera]; }
  /// A block in words, e.g. "shot 'a'".
  std::string name(std::size_t block) const;

 private:
  struct State {
    std::vector<Camera> cameras;
    std::vector<Pose> cam_from_rig, rig_from_world, world_from_body;
    std::vector<Eigen::Vector3d> bends;
    std::vector<Eigen::Vector3d> places;  ///< free bodies' points in the world, by first_point_
    Eigen::Vector2d print_scale{1, 1};
  };
  /// An observation that counts, or (without weights) any.
  struct Seen {
    std::uint32_t shot = 0, camera = 0, body = 0, point = 0;  ///< point: among all bodies'
    Eigen::Vector2d pixel{0, 0};
    double w00 = 0, w10 = 0, w11 = 0;  ///< whitening, lower triangle
  };
  struct ViewOf {              ///< a camera in a shot, at the state moved to
    Eigen::Matrix3d rotation;  ///< cam_from_world
    Eigen::Vector3d translation;
  };
  struct PlacedPoint {
    Eigen::Vector3d place{0, 0, 0}, normal{0, 0, 1};  ///< in the world
    double radius = 0;
  };
  struct PlacedBody {
    Eigen::Matrix3d rotation;  ///< world_from_body
    Eigen::Vector3d center;    ///< of turning, in the world
  };

  void lay_out();
  void add_terms();
  void place();
  double fit_pose(std::size_t body);
  bool predict(const Seen& seen, Eigen::Vector2d& pixel) const;
  double evaluate_observation(const Seen& seen, double* residual, double* jacobian) const;
  double evaluate_bar(const ScaleBar& bar, double* residual, double* jacobian) const;
  void fill_jacobian(const Seen& seen, const Eigen::Vector3d& in_camera, const Eigen::Matrix<double, 2, 6>& by_pose,
                     const double* by_intrinsics, const Eigen::Vector2d& enlarged, double* jacobian) const;
  Eigen::Vector3d center_of(const State& state, std::size_t body) const;
  Eigen::Vector3d point_of(const State& state, std::size_t body, std::size_t point) const;
  Eigen::Vector3d offset_of_rig() const;
  Eigen::Vector3d mean_point(const State& state) const;
  bool is_rigged(std::size_t camera) const { return rigged_[camera] != 0; }
  int columns(int block) const { return block < 0 ? 0 : sizes[std::size_t(block)]; }

  const Adjustment& start_;
  const AdjustOptions& options_;
  State kept_, moved_, begin_;
  std::vector<std::size_t> first_point_;
  std::vector<std::uint32_t> body_of_point_;
  std::vector<const BodyPoint*> points_;
  std::vector<int> blocks_of_points_, camera_blocks_, rig_blocks_;
  std::vector<std::vector<int>> free_intrinsics_;
  std::vector<char> rigged_, counts_;
  std::vector<Eigen::Vector3d> middles_;
  int print_block_ = -1;
  bool scale_is_free_ = false;
  std::vector<Eigen::Index> offset_;  ///< of blocks in a step
  Eigen::Index unknowns_ = 0;
  std::vector<Seen> seen_;  ///< terms 0 … ; then bars, then bends
  std::vector<std::uint32_t> bent_bodies_;

  std::vector<LeanLens> lenses_;
  std::vector<ViewOf> views_;                   ///< shot · cameras + camera
  std::vector<Eigen::Matrix3d> rig_rotations_;  ///< cam_from_rig
  std::vector<PlacedPoint> placed_;
  std::vector<PlacedBody> bodies_;
};

}  // namespace lumihull::calib::bundle
