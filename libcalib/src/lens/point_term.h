#pragma once

// One measured point of a calibration body: what the camera predicts, and how that changes. Exported for tests.

#include <lumihull/calib/lens_calibration.h>

#include <Eigen/Core>

namespace lumihull::calib::lens {

using Vector10d = Eigen::Matrix<double, kIntrinsics, 1>;
using Matrix2x10d = Eigen::Matrix<double, 2, kIntrinsics>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

/// The ten parameters in the order of Intrinsic, and back; picture sizes stay.
LUMIHULL_API Vector10d parameters_of(const Camera& camera);
LUMIHULL_API void set_parameters(Camera& camera, const Vector10d& parameters);

/// Pixel at which a match should be measured: the point's, or the centre of a circle's ellipse. false where it is behind
/// the camera or beyond the lens's domain.
///
/// by_camera: d pixel / d parameters. by_pose: d pixel / d (rotation vector, translation) of a small motion in the camera's
/// frame.
LUMIHULL_API bool predict(const Camera& camera, const Pose& cam_from_board, const BoardMatch& match, Eigen::Vector2d* pixel,
             Matrix2x10d* by_camera = nullptr, Matrix26d* by_pose = nullptr);

/// W with Wᵀ W = covariance⁻¹: |W r| is r in standard deviations. Covariance: positive definite.
LUMIHULL_API Eigen::Matrix2d whitening(const Eigen::Matrix2d& covariance);

/// The pose after a small motion (rotation vector, translation) in the camera's frame.
LUMIHULL_API Pose moved(const Pose& cam_from_board, const Eigen::Matrix<double, 6, 1>& motion);

LUMIHULL_API Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

}  // namespace lumihull::calib::lens
