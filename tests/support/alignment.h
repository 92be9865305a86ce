#pragma once

#include <lumihull/base/pose.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <span>

namespace lumihull::test {

/// to ≈ motion · (scale · from)
struct Alignment {
  double scale = 1;
  Pose motion;
};

/// The similarity that brings at least three points onto others with the least sum of squared distances (Umeyama 1991);
/// rigid: a motion only.
inline Alignment align_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to, bool rigid) {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = a;
  const double n = double(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) a += from[i] / n, b += to[i] / n;
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  double square = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    product += (to[i] - b) * (from[i] - a).transpose();
    square += (from[i] - a).squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  Alignment result;
  if (!rigid) result.scale = svd.singularValues().dot(sign) / square;
  result.motion = Pose::from_matrix(rotation, b - result.scale * (rotation * a));
  return result;
}

}  // namespace lumihull::test
