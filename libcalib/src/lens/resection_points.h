#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::calib {

/// Four points side by side: what one instruction works on.
constexpr int kLanes = 4;
using Lanes = Eigen::Array<double, kLanes, 1>;

/// The pose that is sought, in coordinates that suit the points: camera = rotation (world - origin) / unit + center.
struct LocalPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center{0, 0, 1};  ///< of the points, in the camera's frame, units
};

/// Matches made ready for many evaluations at different poses.
///
/// The lens is linearised where a point was measured: with c = the normalised, corrected image point, a residual in
/// standard deviations is r = W (c_predicted - c_measured) + e, W = C⁻¹ K (d distorted / d corrected), C Cᵀ =
/// covariance. e is what the linearisation leaves out at one pose (renew_lens_terms): zero for a perfect fit, and so
/// small where the fit is good that it may stand still while the pose moves. Circles: c_predicted is the centre of the
/// undistorted ellipse, in closed form (circle_projection.h); e then holds what the lens does to the ellipse.
struct ResectionPoints {
  struct Block {
    Lanes x, y, z;             ///< world, (point - origin) / unit
    Lanes cx, cy;              ///< measured, corrected
    Lanes w00, w01, w10, w11;  ///< W
    Lanes ex, ey;              ///< e
    Lanes r2, nx, ny, nz;      ///< circle: squared radius, unit², and normal; 0 for a point
  };
  struct LensBlock {
    Lanes dx, dy;              ///< measured, distorted
    Lanes v00, v01, v10, v11;  ///< C⁻¹ K
  };

  Camera camera;
  std::size_t count = 0;
  std::vector<Block> blocks;    ///< lanes beyond `count` have W = 0
  std::vector<LensBlock> lens;  ///< empty for a camera without distortion
  std::vector<double> seen;     ///< 1, or 0 for a pixel that no ray of the lens meets; whole blocks
  bool circles = false;
  Eigen::Vector3d origin{0, 0, 0};                     ///< mean of the world points
  double unit = 1;                                     ///< their RMS distance from it
  Eigen::Vector3d extent{0, 0, 0};                     ///< RMS along their principal axes, units, descending
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< those axes, columns, right-handed
  double spread_px = 0;                                ///< RMS distance of the pixels from their mean

  ResectionPoints() = default;
  /// Errors: invalid_argument (not finite, no covariance), degenerate (fewer than four places, or all on a line).
  ResectionPoints(const Camera& camera, std::span<const PointMatch> matches);

  Eigen::Vector3d world(std::size_t i) const {  ///< local
    const Block& b = blocks[i / kLanes];
    const auto k = Eigen::Index(i % kLanes);
    return {b.x[k], b.y[k], b.z[k]};
  }
  Eigen::Vector2d corrected(std::size_t i) const {
    const Block& b = blocks[i / kLanes];
    const auto k = Eigen::Index(i % kLanes);
    return {b.cx[k], b.cy[k]};
  }

  Pose pose(const LocalPose& p) const;

  /// Makes the residuals at this pose exact. Points that the lens can't show there keep e = 0.
  void renew_lens_terms(const LocalPose& pose);
};

/// Residuals of a block at a pose, and what derivatives need.
struct BlockResidual {
  Lanes px, py, pz;     ///< rotation * point
  Lanes nx, ny, nz, k;  ///< circles: rotated normal, r² / depth
  Lanes cx, cy, iz;     ///< prediction, 1 / depth of the predicted point
  Lanes rx, ry;
  Lanes front;  ///< depth, must be > 0

  template <bool kCircles>
  static BlockResidual at(const ResectionPoints::Block& b, const LocalPose& pose) {
    const Eigen::Matrix3d& r = pose.rotation;
    BlockResidual o;
    o.px = r(0, 0) * b.x + r(0, 1) * b.y + r(0, 2) * b.z;
    o.py = r(1, 0) * b.x + r(1, 1) * b.y + r(1, 2) * b.z;
    o.pz = r(2, 0) * b.x + r(2, 1) * b.y + r(2, 2) * b.z;
    Lanes x = o.px + pose.center.x(), y = o.py + pose.center.y(), z = o.pz + pose.center.z();
    o.front = z;
    if constexpr (kCircles) {
      o.nx = r(0, 0) * b.nx + r(0, 1) * b.ny + r(0, 2) * b.nz;
      o.ny = r(1, 0) * b.nx + r(1, 1) * b.ny + r(1, 2) * b.nz;
      o.nz = r(2, 0) * b.nx + r(2, 1) * b.ny + r(2, 2) * b.nz;
      o.k = b.r2 / z;
      const Lanes kn = o.k * o.nz;
      x += kn * o.nx, y += kn * o.ny, z += kn * o.nz - o.k;
      o.front = o.front.min(z);
    }
    o.iz = z.inverse();
    o.cx = x * o.iz, o.cy = y * o.iz;
    const Lanes ux = o.cx - b.cx, uy = o.cy - b.cy;
    o.rx = b.w00 * ux + b.w01 * uy + b.ex;
    o.ry = b.w10 * ux + b.w11 * uy + b.ey;
    return o;
  }
};

/// d²: squared residuals in standard deviations, infinite where a point is not in front. Returned per point (count).
void squared_distances(const ResectionPoints& points, const LocalPose& pose, std::vector<double>& d2);

/// Σ min(d², limit²) over the points that are seen, and how many are below; stops early above `enough`.
struct Score {
  double cost = 0;
  int inliers = 0;
};
Score truncated_score(const ResectionPoints& points, const LocalPose& pose, double limit, double enough);

}  // namespace lumihull::calib
