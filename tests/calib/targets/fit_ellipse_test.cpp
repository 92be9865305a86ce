// The maximum-likelihood fit on pictures of known truth, against the bound of the same renderer.
#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "ellipse_picture.h"
#include "support.h"

namespace lumihull::calib {
namespace {

using test::EllipseScene;

struct Study {
  double rms = 0, bound = 0, mahalanobis = 0, residual = 0, us = 0;
  int count = 0, good = 0;
};

struct Case {
  double minor_px = 12, aspect = 1, blur_px = 1;
  PlaneNoise noise{64e-6, 0};
  double inner_ratio = 0;
  Eigen::Vector2d light{0, 0};
};

Study study(const Case& c, int phases, int samples, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Study s;
  for (int phase = 0; phase < phases; ++phase) {
    EllipseScene scene = test::scene_of(c.minor_px, c.aspect, 0.7 * phase, c.blur_px, random);
    if (c.inner_ratio > 0) make_ring(scene, c.inner_ratio);
    scene.light = c.light;
    const std::vector<double> values = render(scene);
    const Ellipse& truth = scene.ellipses[0].ellipse;
    if (phase < 4) s.bound += center_bound(scene, c.noise).trace();
    EllipseOptions options;
    options.inner_ratio = c.inner_ratio;
    for (int i = 0; i < samples; ++i) {
      const LightPlane plane = noisy_plane(scene, values, c.noise, random);
      const Ellipse guess = test::rough_guess(truth, random);
      const auto start = std::chrono::steady_clock::now();
      const EllipseFit fit = fit_ellipse(plane, guess, options);
      s.us += std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
      ++s.count;
      if (fit.state != EllipseState::good) continue;
      ++s.good;
      const Eigen::Vector2d error = fit.ellipse.center - truth.center;
      s.rms += error.squaredNorm();
      s.mahalanobis += error.dot(fit.center_covariance().inverse() * error);
      s.residual += fit.residual;
    }
  }
  s.rms = std::sqrt(s.rms / s.good);
  s.bound = std::sqrt(s.bound / std::min(phases, 4));
  s.mahalanobis /= s.good;
  s.residual /= s.good;
  s.us /= s.count;
  return s;
}

void print(const char* what, const Study& s) {
  std::printf("%-28s rms %.4f bound %.4f ratio %.3f maha %.2f residual %.3f good %d/%d %.0f us\n", what, s.rms, s.bound,
              s.rms / s.bound, s.mahalanobis, s.residual, s.good, s.count, s.us);
}

TEST(FitEllipse, Explore) {
  for (const double blur : {0.5, 1.0, 2.0}) print("12 px", study({12, 1, blur}, 6, 100, 1));
  for (const double blur : {0.5, 1.0, 2.0}) print("12 px .5", study({12, .5, blur}, 6, 100, 1));
  for (const double blur : {0.5, 1.0}) print("5 px", study({5, 1, blur}, 6, 100, 1));
  for (const double blur : {0.5, 1.0}) print("5 px .5", study({5, .5, blur}, 6, 100, 1));
  print("40 px", study({40, .7, 1}, 6, 20, 1));
  print("200 px", study({200, 1, 1}, 1, 20, 1));
  print("12 ring", study({12, 1, 1, {64e-6, 0}, .55}, 6, 100, 1));
  print("5 ring", study({5, .5, .7, {64e-6, 0}, .55}, 6, 100, 1));
  print("12 light", study({12, 1, 1, {64e-6, 0}, 0, {.025, 0}}, 6, 100, 1));
}

}  // namespace
}  // namespace lumihull::calib
