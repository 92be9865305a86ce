// What the measurements do not see: where the world is, how it is turned and, sometimes, how large it is.
#include <Eigen/Geometry>

#include "../lens/point_term.h"
#include "body_shape.h"
#include "bundle_problem.h"

namespace lumihull::calib::bundle {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using lens::cross_matrix;

/// Where the first camera that is fixed on the rig has its centre: about it shots are scaled.
Vector3d BundleProblem::offset_of_rig() const {
  for (const AdjustedCamera& c : start_.cameras)
    if (!c.on_rig) return c.cam_from_rig.center();
  return Vector3d::Zero();
}

Vector3d BundleProblem::mean_point(const State& state) const {
  Vector3d sum = Vector3d::Zero();
  std::size_t count = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (blocks_of_points_[i] < 0) continue;
    sum += point_of(state, body_of_point_[i], i - first_point_[body_of_point_[i]]);
    ++count;
  }
  return sum / double(std::max<std::size_t>(1, count));
}

/// Columns: the world shifted by x, y, z; turned about the points' mean m; scaled about it.
MatrixXd BundleProblem::gauge() const {
  const Vector3d mean = mean_point(kept_), offset = offset_of_rig();
  MatrixXd g = MatrixXd::Zero(unknowns_, scale_is_free_ ? 7 : 6);
  for (std::size_t s = 0; s < kept_.rig_from_world.size(); ++s) {
    // R (X - dX) + t for a shift dX = e + ω x (X - m), written as a motion after the pose.
    const Index at = offset_[s];
    const Matrix3d rotation = kept_.rig_from_world[s].rotation.toRotationMatrix();
    const Vector3d& t = kept_.rig_from_world[s].translation;
    g.block<3, 3>(at + 3, 0) = -rotation;
    g.block<3, 3>(at, 3) = -rotation;
    g.block<3, 3>(at + 3, 3) = -rotation * cross_matrix(mean) - cross_matrix(t) * rotation;
    if (scale_is_free_) g.block<3, 1>(at + 3, 6) = t - offset + rotation * mean;
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const int block = blocks_of_points_[i];
    if (block < 0) continue;
    const std::size_t body = body_of_point_[i], point = i - first_point_[body];
    const Index at = offset_[std::size_t(block)];
    if (start_.bodies[body].model == BodyModel::free) {
      const Vector3d off = point_of(kept_, body, point) - mean;
      g.block<3, 3>(at, 0).setIdentity();
      g.block<3, 3>(at, 3) = -cross_matrix(off);
      if (scale_is_free_) g.block<3, 1>(at, 6) = off;
    } else if (point == 0) {
      g.block<3, 3>(at + 3, 0).setIdentity();
      g.block<3, 3>(at, 3).setIdentity();
      g.block<3, 3>(at + 3, 3) = -cross_matrix(center_of(kept_, body) - mean);
    }
  }
  if (scale_is_free_)
    for (std::size_t c = 0; c < kept_.cameras.size(); ++c)
      if (rig_blocks_[c] >= 0)
        g.block<3, 1>(offset_[std::size_t(rig_blocks_[c])] + 3, 6) =
            kept_.cam_from_rig[c].translation + kept_.cam_from_rig[c].rotation * offset;
  return g;
}

MatrixXd BundleProblem::datum() const {
  const Vector3d mean = mean_point(kept_);
  MatrixXd b = MatrixXd::Zero(unknowns_, scale_is_free_ ? 7 : 6);
  Eigen::Matrix<double, 3, Eigen::Dynamic> by_block;
  Eigen::Matrix<double, 3, 2> by_print;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const int block = blocks_of_points_[i];
    if (block < 0) continue;
    const std::size_t body = body_of_point_[i], point = i - first_point_[body];
    const Vector3d off = point_of(kept_, body, point) - mean;
    MatrixXd moved(3, b.cols());
    moved.leftCols<3>().setIdentity();
    moved.middleCols<3>(3) = -cross_matrix(off);
    if (scale_is_free_) moved.block<3, 1>(0, 6) = off;
    point_jacobian(body, point, by_block, by_print);
    b.middleRows(offset_[std::size_t(block)], by_block.cols()) += by_block.transpose() * moved;
    if (print_block_ >= 0 && start_.bodies[body].model != BodyModel::free)
      b.middleRows<2>(offset_[std::size_t(print_block_)]) += by_print.transpose() * moved;
  }
  return b;
}

void BundleProblem::point_jacobian(std::size_t body, std::size_t point,
                                   Eigen::Matrix<double, 3, Eigen::Dynamic>& by_block,
                                   Eigen::Matrix<double, 3, 2>& by_print) const {
  const AdjustedBody& b = start_.bodies[body];
  by_print.setZero();
  if (b.model == BodyModel::free) {
    by_block.setIdentity(3, 3);
    return;
  }
  Matrix35d shape;
  shaped(b.points[point], b.model, middles_[body], kept_.bends[body], kept_.print_scale, &shape);
  const Matrix35d in_world = kept_.world_from_body[body].rotation.toRotationMatrix() * shape;
  by_block.resize(3, b.model == BodyModel::bending ? 9 : 6);
  by_block.leftCols<3>() = -cross_matrix(point_of(kept_, body, point) - center_of(kept_, body));
  by_block.middleCols<3>(3).setIdentity();
  if (b.model == BodyModel::bending) by_block.rightCols<3>() = in_world.leftCols<3>();
  by_print = in_world.rightCols<2>();
}

void BundleProblem::align() {
  // X' = scale R X + t
  const Vector3d now = mean_point(kept_), before = mean_point(begin_);
  Matrix3d product = Matrix3d::Zero();
  double extent = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (blocks_of_points_[i] < 0) continue;
    const std::size_t body = body_of_point_[i], point = i - first_point_[body];
    const Vector3d x = point_of(kept_, body, point) - now, y = point_of(begin_, body, point) - before;
    product += y * x.transpose();
    extent += x.squaredNorm();
  }
  const BestTurn best = best_turn(product);
  const double scale = scale_is_free_ && extent > 0 ? best.trace / extent : 1;
  const Pose turn = Pose::from_matrix(best.rotation, before - scale * best.rotation * now);
  const Vector3d offset = offset_of_rig();

  for (Pose& pose : kept_.rig_from_world) {
    const Eigen::Quaterniond rotation = (pose.rotation * turn.rotation.conjugate()).normalized();
    pose.translation = scale * pose.translation - rotation * turn.translation - (scale - 1) * offset;
    pose.rotation = rotation;
  }
  for (std::size_t c = 0; c < kept_.cameras.size(); ++c) {
    if (rig_blocks_[c] < 0) continue;
    Pose& pose = kept_.cam_from_rig[c];
    pose.translation = scale * pose.translation + (scale - 1) * (pose.rotation * offset);
  }
  for (Pose& pose : kept_.world_from_body) {
    pose.translation = scale * (turn.rotation * pose.translation) + turn.translation;
    pose.rotation = (turn.rotation * pose.rotation).normalized();
  }
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (blocks_of_points_[i] >= 0 && start_.bodies[body_of_point_[i]].model == BodyModel::free)
      kept_.places[i] = scale * (turn.rotation * kept_.places[i]) + turn.translation;
  move(Eigen::VectorXd::Zero(unknowns_));
}

}  // namespace lumihull::calib::bundle
