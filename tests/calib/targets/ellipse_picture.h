// Pictures of ellipses of known truth, by brute force: coverage on a fine grid, a sampled Gaussian, sums over pixels.
// Shares no formula with what it tests.
#pragma once

#include <lumihull/calib/ellipse.h>
#include <lumihull/calib/light_plane.h>

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

namespace lumihull::test {

struct PaintedEllipse {
  calib::Ellipse ellipse;
  double value = 0;
};

struct PaintedBar {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  double value = 0;
};

/// Ellipses, then bars, one painted over the other.
struct EllipseScene {
  int width = 0, height = 0;
  double paper = 0.9;
  std::vector<PaintedEllipse> ellipses;
  std::vector<PaintedBar> bars;
  double blur_px = 1;
  Eigen::Vector2d light{0, 0};  ///< relative change of the light per px, about the picture's middle
  int fine = 8;                 ///< samples a pixel, each way
};

/// A dark ellipse in the middle of a picture that holds its surroundings, at a phase within a pixel that `random`
/// chooses.
EllipseScene scene_of(double minor_px, double aspect, double angle, double blur_px, std::mt19937_64& random);
/// The same with a light centre.
void make_ring(EllipseScene& scene, double inner_ratio);

/// height x width values, row-major.
std::vector<double> render(const EllipseScene& scene);

/// The values with normal noise; values from 1 on are clipped to 1.
calib::LightPlane noisy_plane(const EllipseScene& scene, const std::vector<double>& values,
                              const calib::PlaneNoise& noise, std::mt19937_64& random);

/// The Cramér-Rao bound of the first ellipse's centre, px²: Fisher's information by finite differences of the renderer;
/// unknown are centre, shape, both values and the blur. A second ellipse moves with the first.
Eigen::Matrix2d center_bound(const EllipseScene& scene, const calib::PlaneNoise& noise);

/// The ellipse displaced and deformed as a detector's first answer is.
calib::Ellipse rough_guess(const calib::Ellipse& truth, std::mt19937_64& random);

}  // namespace lumihull::test
