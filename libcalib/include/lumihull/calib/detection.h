#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/calib/target_set.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lumihull::calib {

/// One point that was measured in a photograph.
struct Feature {
  int index = 0;                ///< in TargetDesign::feature or PointGrid::point
  Eigen::Vector2d pixel{0, 0};  ///< px. Circles: the *ellipse's* centre, which is not where the circle's centre is seen
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< px²
  /// Circles: the ellipse's dual conic, (2,2) = 1. Corners: zero.
  Eigen::Matrix3d dual_conic = Eigen::Matrix3d::Zero();
};

/// A target that was found and read.
struct Detection {
  int design = 0;  ///< index into TargetSet::designs; for a point grid: into TargetSet::grids
  int id = 0;      ///< -1: a point grid
  std::vector<Feature> features;  ///< those that could be measured, by ascending index
  int corrected = 0;              ///< cells that were read wrongly and corrected
  int erased = 0;                 ///< cells that could not be read
  /// Pixel from the target's plane (m): predicted ellipse centres meet the measured ones (see circle_projection.h).
  Eigen::Matrix3d pixel_from_target = Eigen::Matrix3d::Identity();
  double rms_px = 0;  ///< sqrt(Σ (dx² + dy²) / features) about that homography
};

/// Why something that looked like a target was refused.
struct RefusedTarget {
  enum class Reason : std::uint8_t {
    no_code,           ///< its cells are no id of its family
    homography,        ///< its points do not lie as printed
    duplicate,         ///< the id was found twice, or something else in its place
    too_few_features,  ///< too little of it could be measured
    unknown_id,        ///< an id that the set does not hold
    overexposed,       ///< too little of it could be measured, for the light about it is clipped: expose less
  };
  Reason reason = Reason::no_code;
  Eigen::Vector2d pixel{0, 0};
  double size_px = 0;
  int id = -1;  ///< where one was read
};

struct Detections {
  std::vector<Detection> targets;  ///< by design, id
  std::vector<RefusedTarget> refused;
};

}  // namespace lumihull::calib
