// The maximum-likelihood fit on pictures of known truth, against the bound of the same renderer.
#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <ctime>

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

double cpu_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * double(t.tv_sec) + 1e-3 * double(t.tv_nsec);
}

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
      const double start = cpu_us();
      const EllipseFit fit = fit_ellipse(plane, guess, options);
      s.us += cpu_us() - start;
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
  print("12 light", study({12, 1, 1, {64e-6, 0}, 0, {.012, 0}}, 6, 100, 1));
  print("12 hetero", study({12, 1, 1, {1e-5, 4e-4}}, 6, 100, 1));
  print("12 .3", study({12, .3, 1}, 6, 100, 1));
}

TEST(FitEllipse, ExploreBias) {
  for (const double minor : {5.0, 8.0, 12.0, 40.0})
    for (const double aspect : {1.0, 0.5, 0.3})
      for (const double blur : {0.3, 0.5, 1.0, 2.0}) {
        std::mt19937_64 random(3);
        Eigen::Vector2d sum(0, 0);
        double worst = 0, axis = 0, blur_error = 0, dual = 0;
        int good = 0;
        for (int i = 0; i < 16; ++i) {
          EllipseScene scene = test::scene_of(minor, aspect, 0.37 * i, blur, random);
          std::mt19937_64 none(1);
          LightPlane plane = noisy_plane(scene, render(scene), {1e-14, 0}, none);
          plane.noise.read = 64e-6;
          const Ellipse& truth = scene.ellipses[0].ellipse;
          const EllipseFit fit = fit_ellipse(plane, test::rough_guess(truth, random));
          const EllipseFit start = dual_conic_fit(plane, truth);
          if (start.state == EllipseState::good) dual = std::max(dual, (start.ellipse.center - truth.center).norm());
          if (fit.state != EllipseState::good) continue;
          ++good;
          sum += fit.ellipse.center - truth.center;
          worst = std::max(worst, (fit.ellipse.center - truth.center).norm());
          axis += (fit.ellipse.b - truth.b) / 16;
          blur_error += (fit.blur_px - blur) / 16;
        }
        std::printf("minor %3.0f aspect %.1f blur %.1f: good %d mean %.5f worst %.5f axis %.4f blur %.4f dual %.4f\n", minor, aspect, blur, good,
                    (sum / 16).norm(), worst, axis, blur_error, dual);
      }
}

TEST(FitEllipse, ExploreOcclusion) {
  for (const double minor : {6.0, 12.0, 40.0})
    for (const double value : {0.1, 0.5, 0.9}) {
      std::mt19937_64 random(5);
      std::printf("minor %.0f bar %.1f:", minor, value);
      for (const double hidden : {-0.1, 0.1, 0.3, 0.6, 1.0}) {  // how far in, of the radius
        int states[6] = {}, outliers = 0;
        double maha = 0, rms = 0, visible = 0;
        for (int i = 0; i < 40; ++i) {
          EllipseScene scene = test::scene_of(minor, i % 2 ? 0.7 : 1, 0.37 * i, 0.8, random);
          const Ellipse& truth = scene.ellipses[0].ellipse;
          const double b = truth.b;
          scene.bars.push_back({truth.center.x() + b * (1 - hidden), 0, 1000, 1000, value});
          const PlaneNoise noise{64e-6, 0};
          const EllipseFit fit = fit_ellipse(noisy_plane(scene, render(scene), noise, random), test::rough_guess(truth, random));
          ++states[int(fit.state)];
          if (fit.state != EllipseState::good) continue;
          const Eigen::Vector2d error = fit.ellipse.center - truth.center;
          rms += error.squaredNorm();
          const double m = error.dot(fit.center_covariance().inverse() * error);
          outliers += m > 16;
          maha += m;
          visible += fit.visible;
        }
        const int good = states[0];
        std::printf("  | good %d occ %d nofit %d rms %.3f maha %.1f (%d) vis %.2f", good, states[3], states[1], std::sqrt(rms / good),
                    maha / good, outliers, visible / good);
      }
      std::printf("\n");
    }
}

}  // namespace
}  // namespace lumihull::calib
