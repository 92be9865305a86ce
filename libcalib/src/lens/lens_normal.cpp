#include "lens_normal.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace lumihull::calib::lens {

LensCovariance lens_covariance(const Camera& camera, const std::vector<FittedView>& views,
                               const std::array<bool, kIntrinsics>& free) {
  using Matrix10d = Eigen::Matrix<double, kIntrinsics, kIntrinsics>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  LensCovariance result;
  std::vector<int> columns;
  for (int i = 0; i < kIntrinsics; ++i)
    if (free[std::size_t(i)]) columns.push_back(i);
  const Eigen::Index n = Eigen::Index(columns.size());

  // S = Σ over views of JcᵀJc - JcᵀJp (JpᵀJp)⁻¹ JpᵀJc: the Schur complement of the poses.
  Matrix10d whole = Matrix10d::Zero(), schur = Matrix10d::Zero();
  for (const FittedView& view : views) {
    Matrix10d cc = Matrix10d::Zero();
    Matrix6d pp = Matrix6d::Zero();
    Eigen::Matrix<double, 6, kIntrinsics> pc = Eigen::Matrix<double, 6, kIntrinsics>::Zero();
    for (std::size_t m = 0; m < view.counts.size(); ++m) {
      if (!view.counts[m]) continue;
      const BoardMatch& match = view.view->matches[m];
      Eigen::Vector2d pixel;
      Matrix2x10d by_camera;
      Matrix26d by_pose;
      if (!predict(camera, view.cam_from_board, match, &pixel, &by_camera, &by_pose)) continue;
      const Eigen::Matrix2d whiten = whitening(match.covariance);
      result.chi2 += (whiten * (match.pixel - pixel)).squaredNorm();
      ++result.points;
      by_camera = whiten * by_camera;
      by_pose = whiten * by_pose;
      cc.noalias() += by_camera.transpose() * by_camera;
      pc.noalias() += by_pose.transpose() * by_camera;
      pp.noalias() += by_pose.transpose() * by_pose;
    }
    // Scaled to a unit diagonal: radians and metres differ by orders of magnitude.
    const Eigen::Matrix<double, 6, 1> unit = pp.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    pp = unit.asDiagonal() * pp * unit.asDiagonal();
    pc = unit.asDiagonal() * pc;
    whole += cc;
    schur += cc - pc.transpose() * pp.ldlt().solve(pc);
  }
  result.unknowns = int(n) + 6 * int(views.size());
  if (n == 0) return result;

  Eigen::MatrixXd normal(n, n);
  Eigen::VectorXd unit(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = whole(columns[std::size_t(i)], columns[std::size_t(i)]);
    unit(i) = d > 0 ? 1 / std::sqrt(d) : 0;
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      normal(i, j) = schur(columns[std::size_t(i)], columns[std::size_t(j)]) * unit(i) * unit(j);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  result.least_eigenvalue = eigen.eigenvalues()(0);
  if (!(result.least_eigenvalue > 0)) return result;
  const Eigen::MatrixXd inverse = unit.asDiagonal() * eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
                                  unit.asDiagonal();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      result.covariance(columns[std::size_t(i)], columns[std::size_t(j)]) = 0.5 * (inverse(i, j) + inverse(j, i));
  return result;
}

}  // namespace lumihull::calib::lens
