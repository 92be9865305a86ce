#include "lens/linear_pose.h"

#include <lumihull/internal/small_matrices.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <cmath>

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Matrix34 = Eigen::Matrix<double, 3, 4>;

/// The same elimination for N = 4 (space) or 3 (plane).
template <int N>
bool solve_linear(const Eigen::Matrix<double, N, N>& s, const Eigen::Matrix<double, N, N>& su,
                  const Eigen::Matrix<double, N, N>& sv, const Eigen::Matrix<double, N, N>& sq,
                  Eigen::Matrix<double, 3, N>& m) {
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> first(s);
  if (!(first.vectorD().minCoeff() > 1e-12 * first.vectorD().maxCoeff())) return false;
  const Eigen::Matrix<double, N, N> u = first.solve(su), v = first.solve(sv);
  const Eigen::Matrix<double, N, N> q = sq - su * u - sv * v;
  const Eigen::Matrix<double, N - 1, N - 1> left = q.template topLeftCorner<N - 1, N - 1>();
  const Eigen::LDLT<Eigen::Matrix<double, N - 1, N - 1>> second(left);
  if (!(second.vectorD().minCoeff() > 1e-13 * sq.diagonal().maxCoeff())) return false;
  Eigen::Matrix<double, N, 1> row;
  row << -second.solve(q.template topRightCorner<N - 1, 1>()), 1;
  m << (u * row).transpose(), (v * row).transpose(), row.transpose();
  return m.allFinite();
}

}  // namespace

void LinearSums::add(const Vector3d& point, const Vector2d& image) {
  const Vector4d x(point.x(), point.y(), point.z(), 1);
  const Matrix4d xx = x * x.transpose();
  s += xx, su += image.x() * xx, sv += image.y() * xx, sq += image.squaredNorm() * xx;
}

bool LinearSums::solve(Matrix34& m) const { return solve_linear<4>(s, su, sv, sq, m); }

bool linear_pose(const ResectionPoints& points, LocalPose& pose, bool& reflected) {
  // Image relative to its mean: keeps digits where the points are far off the axis.
  Vector2d mean = Vector2d::Zero();
  double seen = 0;
  for (std::size_t i = 0; i < points.count; ++i)
    if (points.seen[i] > 0) mean += points.corrected(i), seen += 1;
  if (seen < 6) return false;
  mean /= seen;
  LinearSums sums;
  for (std::size_t i = 0; i < points.count; ++i)
    if (points.seen[i] > 0) sums.add(points.world(i), points.corrected(i) - mean);
  Matrix34 m;
  if (!sums.solve(m)) return false;
  m.row(0) += mean.x() * m.row(2), m.row(1) += mean.y() * m.row(2);
  const Matrix3d left = m.leftCols<3>();
  reflected = left.determinant() < 0;
  const double scale = left.norm() / std::sqrt(3.0);
  if (!(scale > 0)) return false;
  pose.rotation = internal::nearest_rotation(left).rotation;
  pose.center = m.col(3) / scale;
  return pose.center.allFinite();
}

int planar_poses(const ResectionPoints& points, std::array<LocalPose, 2>& poses) {
  Matrix3d s = Matrix3d::Zero(), su = s, sv = s, sq = s;
  Vector2d mean = Vector2d::Zero();
  double seen = 0;
  for (std::size_t i = 0; i < points.count; ++i)
    if (points.seen[i] > 0) mean += points.corrected(i), seen += 1;
  if (seen < 4) return 0;
  mean /= seen;
  const Eigen::Matrix<double, 2, 3> to_plane = points.axes.leftCols<2>().transpose();
  for (std::size_t i = 0; i < points.count; ++i) {
    if (points.seen[i] == 0) continue;
    const Vector2d p = to_plane * points.world(i), image = points.corrected(i) - mean;
    const Vector3d x(p.x(), p.y(), 1);
    const Matrix3d xx = x * x.transpose();
    s += xx, su += image.x() * xx, sv += image.y() * xx, sq += image.squaredNorm() * xx;
  }
  Matrix3d h;
  if (!solve_linear<3>(s, su, sv, sq, h)) return 0;
  h.row(0) += mean.x() * h.row(2), h.row(1) += mean.y() * h.row(2);

  // A camera turned so that it looks along the centre's ray sees the linear part in a plane across that ray.
  const Vector3d ray = Vector3d(h(0, 2), h(1, 2), 1).normalized();
  const Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(ray, Vector3d::UnitZ()).toRotationMatrix();
  const Matrix3d g = turn * h;  // g.col(2) is along z
  const Matrix2d linear = (g.topLeftCorner<2, 2>()) / g(2, 2);
  const Eigen::JacobiSVD<Matrix2d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double scale = svd.singularValues()[0];
  if (!(scale > 0)) return 0;
  const Matrix2d flat = linear / scale;
  // Third row of the rotation's first two columns: unit columns, and columns perpendicular to each other. Taken along
  // the direction that is foreshortened, so that both come out with the right signs.
  const double sine = std::sqrt(std::max(0.0, 1 - std::pow(svd.singularValues()[1] / scale, 2)));
  const Vector2d third = sine * svd.matrixV().col(1);
  for (int k = 0; k < 2; ++k) {
    Matrix3d r;
    r.col(0) << flat.col(0), k ? -third[0] : third[0];
    r.col(1) << flat.col(1), k ? -third[1] : third[1];
    r.col(2) = r.col(0).cross(r.col(1));
    poses[std::size_t(k)].rotation = turn.transpose() * r * points.axes.transpose();
    poses[std::size_t(k)].center = turn.transpose() * Vector3d(0, 0, 1 / scale);
  }
  return 2;
}

LocalPose mirrored(const ResectionPoints& points, const LocalPose& pose) {
  const Vector3d ray = pose.center.normalized();
  const Matrix3d reflect = Matrix3d::Identity() - 2 * ray * ray.transpose();
  const Matrix3d r = pose.rotation * points.axes;
  Matrix3d m;
  m.col(0) = reflect * r.col(0), m.col(1) = reflect * r.col(1);
  m.col(2) = m.col(0).cross(m.col(1));
  return {m * points.axes.transpose(), pose.center};
}

}  // namespace lumihull::calib
