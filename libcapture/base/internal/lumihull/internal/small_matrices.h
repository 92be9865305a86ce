#pragma once

// Decompositions of small matrices that many files need; compiled once, for Eigen's templates take seconds a file.

#include <lumihull/base/api.h>

#include <Eigen/Core>

namespace lumihull::internal {

/// A symmetric matrix A = V diag(values) V^T: values ascending, V's columns orthonormal. Of `a` the lower triangle is
/// read.
struct SymmetricAxes {
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors;
};
LUMIHULL_API SymmetricAxes symmetric_axes(const Eigen::Matrix3d& a);

/// The rotation R of largest tr(R^T M), which is the one nearest to M in the Frobenius norm (Umeyama 1991), by
/// M = U S V^T.
struct NearestRotation {
  Eigen::Matrix3d rotation;         ///< U diag(1, 1, d) V^T, d = ± 1
  Eigen::Vector3d singular_values;  ///< descending
  bool reflected = false;           ///< d = -1: without it U V^T would be a reflection
};
LUMIHULL_API NearestRotation nearest_rotation(const Eigen::Matrix3d& m);

/// Whether a symmetric matrix without negative diagonal, scaled to a diagonal of ones (zeros stay), is finite and has
/// no eigenvalue below -1e-6. Of `c` the lower triangle is read.
LUMIHULL_API bool is_covariance(const Eigen::Ref<const Eigen::MatrixXd>& c);

}  // namespace lumihull::internal
