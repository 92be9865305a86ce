#pragma once

#include <lumihull/base/camera.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>

namespace lumihull::slf {

/// Ray directions of a view, many at a time: Camera::ray, turned into the world.
class ViewRays {
 public:
  explicit ViewRays(const View& view);

  /// Whether every place of the picture has a ray.
  bool everywhere() const { return everywhere_; }
  /// Directions in the world (1 along the camera's axis) at pixels (u, v), `count` of them; NaN where there is no ray.
  void fill(std::size_t count, const double* u, const double* v, float* x, float* y, float* z) const;
  /// d direction / d (u, v), where there is a ray.
  Eigen::Matrix<float, 3, 2> slopes(const Eigen::Vector2d& pixel) const;
  /// Bounds of the rays' (x / z, y / z) in the camera's frame over part of the picture; infinite where one has no ray.
  Eigen::AlignedBox2d bounds(int x0, int y0, int width, int height) const;

 private:
  Camera camera_;
  Eigen::Matrix3d world_from_cam_;
  bool everywhere_;
  double radius2_;  // of the lens's domain, squared; used unless everywhere_
};

}  // namespace lumihull::slf
