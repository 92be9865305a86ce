#pragma once

// A camera prepared for predicting many points: what `Camera` computes, without its generality in each call.

#include <lumihull/base/camera.h>

#include <cmath>

namespace lumihull::calib::bundle {

class LeanLens {
 public:
  LeanLens() = default;
  explicit LeanLens(const Camera& camera);

  /// Where a point in the camera's frame is seen, and there: distorted coordinates d and d (distorted) / d (corrected).
  struct Seen {
    Eigen::Vector2d pixel{0, 0};
    double x = 0, y = 0;               ///< distorted, normalised
    double jxx = 1, jxy = 0, jyy = 1;  ///< symmetric
  };

  /// near: a pixel close to which it is expected. false behind the camera or beyond the lens's domain. The same as
  /// Camera::project to 1e-12 of the focal length: Newton steps from `near` inside of the disc where the lens is
  /// one-to-one by a bound; elsewhere Camera::distort.
  bool see(const Eigen::Vector3d& point, const Eigen::Vector2d& near, Seen& seen) const;

  /// d pixel / d point, rows u and v.
  void by_point(const Eigen::Vector3d& point, const Seen& seen, Eigen::Vector3d& u, Eigen::Vector3d& v) const;
  /// d pixel / d (f, s, skew, u0, v0, k1, k2, k3, p1, p2).
  void by_parameters(const Seen& seen, double* u, double* v) const;

  const Camera& camera() const { return camera_; }

 private:
  Camera camera_;
  bool distorts_ = false;
  double fu_ = 0, safe_r2_ = 0;  ///< squared radius of distorted coordinates
};

}  // namespace lumihull::calib::bundle
