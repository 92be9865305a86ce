#include "zhang.h"

#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace lumihull::calib::lens {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The rotation that is nearest to m, and m's mean singular value; false where m has no rank 3.
bool rotation_and_scale(const Matrix3d& m, Matrix3d& rotation, double& scale) {
  const internal::NearestRotation nearest = internal::nearest_rotation(m);
  const Vector3d& s = nearest.singular_values;
  if (!(s(2) > 1e-12 * s(0)) || !std::isfinite(s(0))) return false;
  rotation = nearest.rotation;
  scale = s.mean();
  return true;
}

}  // namespace

std::optional<Matrix3d> zhang_camera(std::span<const Matrix3d> homographies, const ZhangOptions& options) {
  // w ~ [a, 0, d; 0, b, e; d, e, c]: unknown (a, b, c, d, e), of which the assumptions take away.
  const double aspect2 = options.aspect * options.aspect;
  std::vector<Eigen::Matrix<double, 5, 1>> basis;
  using Vector5d = Eigen::Matrix<double, 5, 1>;
  if (options.free_aspect) {
    basis.push_back(Vector5d::Unit(0));
    basis.push_back(Vector5d::Unit(1));
  } else {
    Vector5d both = Vector5d::Zero();
    both(0) = 1 / aspect2;  // w = diag(1 / fu², 1 / fv², …)
    both(1) = 1;
    basis.push_back(both);
  }
  basis.push_back(Vector5d::Unit(2));
  if (options.free_center) {
    basis.push_back(Vector5d::Unit(3));
    basis.push_back(Vector5d::Unit(4));
  }
  const Eigen::Index n = Eigen::Index(basis.size());
  if (2 * Eigen::Index(homographies.size()) < n - 1) return std::nullopt;

  Eigen::MatrixXd equations(2 * homographies.size(), n);
  Eigen::Index row = 0;
  for (const Matrix3d& h : homographies) {
    const auto product = [&](int i, int j) {
      const Vector3d p = h.col(i), q = h.col(j);
      Vector5d v;
      v << p.x() * q.x(), p.y() * q.y(), p.z() * q.z(), p.x() * q.z() + p.z() * q.x(), p.y() * q.z() + p.z() * q.y();
      return v;
    };
    const double scale = 1 / (h.col(0).squaredNorm() + h.col(1).squaredNorm());
    const Vector5d across = scale * product(0, 1), equal = scale * (product(0, 0) - product(1, 1));
    for (Eigen::Index i = 0; i < n; ++i) {
      equations(row, i) = across.dot(basis[std::size_t(i)]);
      equations(row + 1, i) = equal.dot(basis[std::size_t(i)]);
    }
    row += 2;
  }
  if (!equations.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations, Eigen::ComputeFullV);
  const Eigen::VectorXd x = svd.matrixV().col(n - 1);
  Vector5d w = Vector5d::Zero();
  for (Eigen::Index i = 0; i < n; ++i) w += x(i) * basis[std::size_t(i)];
  if (w(0) < 0) w = -w;
  const double a = w(0), b = w(1);
  if (!(a > 0) || !(b > 0)) return std::nullopt;
  const double u0 = -w(3) / a, v0 = -w(4) / b;
  const double scale = w(2) - a * u0 * u0 - b * v0 * v0;  // c = scale + a u0² + b v0²
  if (!(scale > 0)) return std::nullopt;
  const double fu = std::sqrt(scale / a), fv = std::sqrt(scale / b);
  Matrix3d k;
  k << fu, 0, u0, 0, fv, v0, 0, 0, 1;
  if (!k.allFinite()) return std::nullopt;
  return k;
}

std::optional<Pose> pose_from_homography(const Matrix3d& h, const Vector2d& inside) {
  Matrix3d m = h / (0.5 * (h.col(0).norm() + h.col(1).norm()));
  if ((m * inside.homogeneous()).z() < 0) m = -m;
  Matrix3d frame;
  frame << m.col(0), m.col(1), m.col(0).cross(m.col(1));
  Matrix3d rotation;
  double scale = 1;
  if (!frame.allFinite() || !rotation_and_scale(frame, rotation, scale)) return std::nullopt;
  return Pose::from_matrix(rotation, m.col(2));
}

std::optional<Pose> pose_from_projection(const Eigen::Matrix<double, 3, 4>& projection, const Vector3d& inside) {
  Eigen::Matrix<double, 3, 4> m = projection;
  if ((m * inside.homogeneous()).z() < 0) m = -m;
  Matrix3d rotation;
  double scale = 1;
  if (!m.allFinite() || !rotation_and_scale(m.leftCols<3>(), rotation, scale)) return std::nullopt;
  return Pose::from_matrix(rotation, m.col(3) / scale);
}

std::optional<Matrix3d> camera_matrix_of(const Eigen::Matrix<double, 3, 4>& m) {
  // M Mᵀ (left block) = K Kᵀ: a Cholesky factorisation from the last row upwards.
  const Matrix3d q = m.leftCols<3>() * m.leftCols<3>().transpose();
  if (!(q(2, 2) > 0)) return std::nullopt;
  const Matrix3d w = q / q(2, 2);
  Matrix3d k = Matrix3d::Identity();
  k(0, 2) = w(0, 2);
  k(1, 2) = w(1, 2);
  const double vv = w(1, 1) - k(1, 2) * k(1, 2);
  if (!(vv > 0)) return std::nullopt;
  k(1, 1) = std::sqrt(vv);
  k(0, 1) = (w(0, 1) - k(0, 2) * k(1, 2)) / k(1, 1);
  const double uu = w(0, 0) - k(0, 1) * k(0, 1) - k(0, 2) * k(0, 2);
  if (!(uu > 0)) return std::nullopt;
  k(0, 0) = std::sqrt(uu);
  if (!k.allFinite()) return std::nullopt;
  return k;
}

}  // namespace lumihull::calib::lens
