#include <lumihull/internal/small_matrices.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace lumihull::internal {

SymmetricAxes symmetric_axes(const Eigen::Matrix3d& a) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

NearestRotation nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const bool reflected = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0;
  const Eigen::Vector3d signs(1, 1, reflected ? -1 : 1);
  return {svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose(), svd.singularValues(), reflected};
}

bool is_covariance(const Eigen::Ref<const Eigen::MatrixXd>& c) {
  const Eigen::VectorXd unit = c.diagonal().unaryExpr([](double v) { return v > 0 ? 1 / std::sqrt(v) : 0.0; });
  const Eigen::MatrixXd scaled = unit.asDiagonal() * c * unit.asDiagonal();
  return scaled.allFinite() &&
         Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues()(0) > -1e-6;
}

}  // namespace lumihull::internal
