#pragma once

#include <lumihull/base/api.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace lumihull {

static_assert(alignof(Eigen::Quaterniond) == 16,
              "compile with -DEIGEN_MAX_STATIC_ALIGN_BYTES=16 (linking lumihull::base in CMake does): the library's "
              "types must have one layout, whatever instruction set their user compiles for");

/// A rigid transform: b = rotation * a + translation. Name variables b_from_a.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit length
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }

  /// c_from_a = c_from_b * b_from_a
  Pose operator*(const Pose& b_from_a) const {
    return {(rotation * b_from_a.rotation).normalized(), rotation * b_from_a.translation + translation};
  }

  Pose inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {q, -(q * translation)};
  }

  /// Where b's origin is in a: for cam_from_world the camera's centre in the world.
  Eigen::Vector3d center() const { return -(rotation.conjugate() * translation); }

  /// 3 x 4 matrix [R t].
  Eigen::Matrix<double, 3, 4> matrix() const {
    Eigen::Matrix<double, 3, 4> m;
    m << rotation.toRotationMatrix(), translation;
    return m;
  }

  /// From a rotation matrix (orthogonalised) and a translation.
  static Pose from_matrix(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) {
    return {Eigen::Quaterniond(r).normalized(), t};
  }
};

/// The pose of a camera at `eye` that looks at `target`, x right, y down, z forward. `up` need not be perpendicular.
LUMIHULL_API Pose look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up);

}  // namespace lumihull
