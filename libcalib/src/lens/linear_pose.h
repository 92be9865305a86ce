#pragma once

#include <array>

#include "lens/resection_points.h"

namespace lumihull::calib {

/// A camera matrix from centred points: the direct linear transform (Hartley & Zisserman 2000, 7.1) with the depth of
/// the points' centre as its scale, m₃ · (0, 0, 0, 1) = 1. That depth is never zero, and the algebraic error is then
/// the image's, weighted with each point's depth over that of the centre (7.2, geometric interpretation).
///
/// Eliminating the first two rows leaves three unknowns. Sums over the points X = (x, y, z, 1), image (u, v).
struct LinearSums {
  Eigen::Matrix4d s = Eigen::Matrix4d::Zero(), su = s, sv = s, sq = s;  ///< Σ XXᵀ, u XXᵀ, v XXᵀ, (u² + v²) XXᵀ

  void add(const Eigen::Vector3d& point, const Eigen::Vector2d& image);
  /// false where the points don't determine it (coplanar, …).
  bool solve(Eigen::Matrix<double, 3, 4>& m) const;
};

/// Start from all points in general position. reflected: the linear answer is a mirror image, as of points that lie
/// behind the camera, or of a left-handed world. false: no answer.
bool linear_pose(const ResectionPoints& points, LocalPose& pose, bool& reflected);

/// The two starts from points near a plane: from the homography's linear part at the points' centre, whose singular
/// values are those of a foreshortened plane (1, cos θ) / distance, there are two tilts (Collins & Bartoli, IPPE, IJCV
/// 2014). Returns how many (0 or 2).
int planar_poses(const ResectionPoints& points, std::array<LocalPose, 2>& poses);

/// The other pose of a plane that is seen nearly as this one: its depths mirrored about the line of sight (Schweighofer
/// & Pinz, PAMI 2006).
LocalPose mirrored(const ResectionPoints& points, const LocalPose& pose);

}  // namespace lumihull::calib
