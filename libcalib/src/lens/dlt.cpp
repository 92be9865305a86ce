#include <lumihull/base/error.h>
#include <lumihull/calib/resect.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/LU>
#include <cmath>

#include "lens/linear_pose.h"

namespace lumihull::calib {

Eigen::Matrix<double, 3, 4> direct_linear_transform(std::span<const Eigen::Vector2d> pixels,
                                                    std::span<const Eigen::Vector3d> world) {
  const auto degenerate = [](const char* message) {
    throw Error(ErrorCode::degenerate, message, "direct_linear_transform");
  };
  if (pixels.size() != world.size() || pixels.size() < 6)
    throw Error(ErrorCode::invalid_argument, "expected at least 6 pixels and as many world points",
                "direct_linear_transform");
  const double n = double(pixels.size());
  Eigen::Vector2d mean2 = Eigen::Vector2d::Zero();
  Eigen::Vector3d mean3 = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pixels.size(); ++i) mean2 += pixels[i] / n, mean3 += world[i] / n;
  double spread2 = 0;
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    spread2 += (pixels[i] - mean2).squaredNorm() / n;
    moments += (world[i] - mean3) * (world[i] - mean3).transpose() / n;
  }
  if (!std::isfinite(spread2) || !moments.allFinite())
    throw Error(ErrorCode::invalid_argument, "points must be finite", "direct_linear_transform");
  const double scale2 = std::sqrt(spread2 / 2), scale3 = std::sqrt(moments.trace() / 3);
  const Eigen::Vector3d extent = internal::symmetric_axes(moments).values;
  if (!(scale2 > 0) || !(extent[0] > 1e-10 * extent[2])) degenerate("points lie in one plane, or on a line");

  LinearSums sums;
  for (std::size_t i = 0; i < pixels.size(); ++i) sums.add((world[i] - mean3) / scale3, (pixels[i] - mean2) / scale2);
  Eigen::Matrix<double, 3, 4> m;
  if (!sums.solve(m)) degenerate("points don't determine a camera matrix");
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (!(m.row(2).dot(((world[i] - mean3) / scale3).homogeneous()) > 0))
      degenerate("points lie before and behind the camera");
  Eigen::Matrix3d pixel_from;
  pixel_from << scale2, 0, mean2.x(), 0, scale2, mean2.y(), 0, 0, 1;
  Eigen::Matrix4d to = Eigen::Matrix4d::Identity();
  to.topLeftCorner<3, 3>() /= scale3;
  to.topRightCorner<3, 1>() = -mean3 / scale3;
  m = pixel_from * m * to;
  return m / m.row(2).head<3>().norm();  // third row times a point: its depth, in the world's unit
}

}  // namespace lumihull::calib
