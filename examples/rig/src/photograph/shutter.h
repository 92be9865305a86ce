#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/rig/photographer.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "objects/noise.h"

namespace lumihull::rig {

/// The camera's frame -> world at one moment.
struct Moment {
  Eigen::Matrix3d world_from_cam;
  Eigen::Vector3d center;

  Pose cam_from_world() const {
    return Pose::from_matrix(world_from_cam.transpose(), -world_from_cam.transpose() * center);
  }
};

/// The lens' opening and the time that it is open: where the rays of a pixel start, and when.
class Shutter {
 public:
  /// center_depth: the depth of the scene's centre, sharp where the options name no distance.
  Shutter(const View& view, const PhotoOptions& options, std::span<const Pose> during, double center_depth);

  /// Whether all rays start at one point: a pinhole that does not move.
  bool still() const { return radius_m_ == 0 && moments_.size() == 1; }
  bool moves() const { return moments_.size() > 1; }
  double radius_m() const { return radius_m_; }  ///< of the opening
  double focus_m() const { return focus_m_; }    ///< depth of the sharp plane
  /// Diameter of the circle of confusion at a depth, px: f A |1 / depth - 1 / focus|, f in px.
  double confusion_px(double depth) const;
  /// How far the picture of a place at `depth` moves at most while the shutter is open, px: over the picture's corners,
  /// edges' middles and its middle.
  double motion_px(double depth) const;

  /// The camera's place at a time from 0 to 1.
  Moment at(double time) const;
  /// A ray in the world for direction (x, y, 1) in the camera's frame, through a point of the unit disc of the lens;
  /// its distances are depths.
  hull::Ray ray(const Eigen::Vector3d& direction, const Eigen::Vector2d& lens, double time) const;

 private:
  View view_;
  std::vector<Pose> moments_;
  double radius_m_ = 0, focus_m_ = 1;
};

/// The lens' points and times of a pixel's side x side rays: each set is stratified (a point in each square of the unit
/// square, mapped to the disc by Shirley & Chiu 1997; a time in each part of the exposure), and paired with the pixel's
/// rays at random (Cook 1986).
class PixelSamples {
 public:
  explicit PixelSamples(int side);
  /// Another pixel's.
  void shuffle(std::uint64_t hash);
  Eigen::Vector2d lens(int ray) const;
  double time(int ray) const;

 private:
  int side_;
  std::uint64_t hash_ = 0;
  std::vector<int> lens_, time_;  ///< parts of lens and time by ray
};

}  // namespace lumihull::rig
