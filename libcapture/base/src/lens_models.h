#pragma once

// Lens models of other programs, whose polynomials go from the ray to the picture: the other way than ours. Refits in
// both directions minimise the distance in pixels over a grid that covers the whole picture.

#include <lumihull/base/camera.h>

#include <Eigen/Core>
#include <initializer_list>
#include <optional>
#include <string>

namespace lumihull::internal {

/// A camera of COLMAP's or OpenCV's kind: pixel = (fx x_d + cx, fy y_d + cy), (x_d, y_d) = distortion of (X/Z, Y/Z).
struct LUMIHULL_API ForwardCamera {
  enum class Lens {
    none,
    opencv,   ///< rational radial (k1, k2, k3)/(k4, k5, k6) and tangential p1, p2: OpenCV's eight coefficients
    fisheye,  ///< equidistant: theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)
  };
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px; the first pixel's centre is (0.5, 0.5)
  Lens lens = Lens::none;
  double k[6] = {0, 0, 0, 0, 0, 0};
  double p1 = 0, p2 = 0;

  /// Pixel of the ray (x, y, 1).
  Eigen::Vector2d project(const Eigen::Vector2d& ray) const;
  /// The ray (x, y, 1) of a pixel, by safeguarded Newton steps; nullopt where the lens has no (unique) answer.
  std::optional<Eigen::Vector2d> ray(const Eigen::Vector2d& pixel) const;
};

struct Refit {
  Camera camera;
  double largest_error_px = 0;  ///< over a grid of 65 x 49 pixels up to the picture's border
};

/// Our camera for theirs; exact where there is no distortion. Errors: unsupported (naming `name`) where the lens can't
/// be inverted over its picture, or where a pixel would move farther than `limit_px`.
LUMIHULL_API Refit refit_camera(const ForwardCamera& camera, double limit_px, const std::string& name);

/// What an importer notes of a refit.
std::string refit_note(int camera, const Refit& refit);

struct ForwardRefit {
  ForwardCamera camera;
  double largest_error_px = 0;
};

/// Their camera for ours: `terms` = how many radial coefficients may be used (0, 2, 3 or 6). The caller judges the
/// error. Errors: unsupported where our lens model does not cover its picture.
LUMIHULL_API ForwardRefit refit_forward(const Camera& camera, int terms, const std::string& name);

/// With the first of these numbers of terms that is good to 0.01 px, far below what calibration knows, or else with the
/// best of them. Errors: unsupported, also where that is off by more than `limit_px`.
ForwardRefit simplest_refit(const Camera& camera, std::initializer_list<int> terms, double limit_px,
                            const std::string& name);

}  // namespace lumihull::internal
