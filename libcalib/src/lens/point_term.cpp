#include "point_term.h"

#include <lumihull/calib/circle_projection.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace lumihull::calib::lens {

Vector10d parameters_of(const Camera& c) {
  Vector10d p;
  p << c.f, c.s, c.skew, c.u0, c.v0, c.k1, c.k2, c.k3, c.p1, c.p2;
  return p;
}

void set_parameters(Camera& c, const Vector10d& p) {
  c.f = p(0), c.s = p(1), c.skew = p(2), c.u0 = p(3), c.v0 = p(4);
  c.k1 = p(5), c.k2 = p(6), c.k3 = p(7), c.p1 = p(8), c.p2 = p(9);
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

bool predict(const Camera& camera, const Pose& cam_from_board, const BoardMatch& match, Eigen::Vector2d* pixel,
             Matrix2x10d* by_camera, Matrix26d* by_pose) {
  const Eigen::Vector3d point = cam_from_board * match.board;
  if (match.radius > 0) {
    Circle3 circle;
    circle.center = point;
    const Eigen::Vector3d normal = (cam_from_board.rotation * match.normal).normalized();
    circle.u = normal.unitOrthogonal();
    circle.v = normal.cross(circle.u);
    circle.radius = match.radius;
    const auto center = projected_circle_center(camera, circle, by_pose, by_camera);
    if (center) *pixel = *center;
    return center.has_value();
  }
  Matrix23d by_point;
  if (!by_camera && !by_pose) {
    const auto seen = camera.project(point);
    if (seen) *pixel = *seen;
    return seen.has_value();
  }
  if (!camera.project_with_parameter_jacobian(point, pixel, by_pose ? &by_point : nullptr, by_camera)) return false;
  if (by_pose) *by_pose << -by_point * cross_matrix(point), by_point;
  return true;
}

Eigen::Matrix2d whitening(const Eigen::Matrix2d& covariance) {
  const Eigen::LLT<Eigen::Matrix2d> llt(covariance);
  return llt.matrixL().solve(Eigen::Matrix2d::Identity());
}

Pose moved(const Pose& pose, const Eigen::Matrix<double, 6, 1>& motion) {
  const Eigen::Vector3d rotation = motion.head<3>();
  const double angle = rotation.norm();
  // sin(x / 2) / x to where its series' next term is below rounding.
  const double half = angle > 1e-4 ? std::sin(0.5 * angle) / angle : 0.5 - angle * angle / 48;
  Eigen::Quaterniond turn;
  turn.w() = std::cos(0.5 * angle);
  turn.vec() = half * rotation;
  return {(turn * pose.rotation).normalized(), turn * pose.translation + motion.tail<3>()};
}

}  // namespace lumihull::calib::lens
