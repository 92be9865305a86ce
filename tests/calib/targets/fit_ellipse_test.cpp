// The maximum-likelihood fit on pictures of known truth, against the bound of the same renderer.
#include <lumihull/calib/ellipse.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

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
  double paper = 0.9;
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
    scene.paper = c.paper;
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

void report(const char* what, const Study& s) {
  std::printf("%-16s rms %.4f px, %.3f of the bound, mahalanobis² %.2f, residual %.3f, good %d of %d, %.0f us\n", what,
              s.rms, s.rms / s.bound, s.mahalanobis, s.residual, s.good, s.count, s.us);
}

TEST(FitEllipse, ReachesTheBoundAndKnowsItsErrors) {
  struct Row {
    const char* name;
    Case c;
    int phases, samples;
    double most;  // rms over the bound
  };
  const PlaneNoise one_percent{64e-6, 0};  // of the contrast, 0.8
  // Where blur is as wide as the circle, light that may change costs more than elsewhere.
  const Row rows[] = {
      {"12 px, blur .5", {12, 1, 0.5, one_percent}, 4, 150, 1.08},
      {"12 px, blur 1", {12, 1, 1, one_percent}, 4, 150, 1.10},
      {"12 px, blur 2", {12, 1, 2, one_percent}, 4, 150, 1.18},
      {"12 px, tilted", {12, 0.5, 1, one_percent}, 4, 150, 1.12},
      {"12 px, 70 deg", {12, 0.3, 1, one_percent}, 3, 150, 1.12},
      {"5 px, blur .5", {5, 1, 0.5, one_percent}, 4, 150, 1.10},
      {"5 px, tilted", {5, 0.5, 0.7, one_percent}, 4, 150, 1.12},
      {"8 px, 5 %", {8, 0.8, 0.8, {1600e-6, 0}}, 4, 150, 1.12},
      {"40 px", {40, 0.7, 1, one_percent}, 3, 100, 1.12},
      {"photon noise", {12, 0.8, 1, {1e-5, 4e-4}}, 4, 150, 1.12},
      {"12 px ring", {12, 0.8, 1, one_percent, 0.55}, 4, 150, 1.12},
      {"5 px ring", {5, 0.7, 0.6, one_percent, 0.55}, 4, 150, 1.12},
      {"light 30 %", {12, 0.8, 1, one_percent, 0, {0.022, -0.01}, 0.6}, 4, 150, 1.2},
  };
  for (const Row& row : rows) {
    const Study s = study(row.c, row.phases, row.samples, 11);
    report(row.name, s);
    EXPECT_GE(s.good, 0.998 * s.count) << row.name;
    EXPECT_LT(s.rms / s.bound, row.most) << row.name;
    EXPECT_GT(s.rms / s.bound, 0.9) << row.name;  // nobody is below the bound
    EXPECT_NEAR(s.mahalanobis, 2, 0.3) << row.name;
    EXPECT_NEAR(s.residual, 1, 0.03) << row.name;
  }
}

TEST(FitEllipse, TheGoalAtTwelvePixels) {
  // 1 % noise of full contrast, blur 1.
  const Study s = study({12, 1, 1, {64e-6, 0}}, 6, 200, 5);
  EXPECT_LT(s.rms, 0.008);
}

/// The scene without noise, which the fit takes to be there.
EllipseFit fit_exact(const EllipseScene& scene, std::mt19937_64& random, const EllipseOptions& options = {}) {
  std::mt19937_64 none(1);
  LightPlane plane = noisy_plane(scene, render(scene), {1e-14, 0}, none);
  plane.noise.read = 64e-6;
  return fit_ellipse(plane, test::rough_guess(scene.ellipses[0].ellipse, random), options);
}

TEST(FitEllipse, IsNotBiased) {
  std::mt19937_64 random(3);
  for (const double minor : {5.0, 12.0})
    for (const double aspect : {1.0, 0.3})
      for (const double blur : {0.3, 0.5, 2.0})
        for (int i = 0; i < 5; ++i) {
          const EllipseScene scene = test::scene_of(minor, aspect, 0.37 * i, blur, random);
          const Ellipse& truth = scene.ellipses[0].ellipse;
          const EllipseFit fit = fit_exact(scene, random);
          ASSERT_EQ(fit.state, EllipseState::good) << minor << " " << aspect << " " << blur;
          EXPECT_LT((fit.ellipse.center - truth.center).norm(), blur < 0.5 ? 0.003 : 0.001);
          EXPECT_NEAR(fit.ellipse.a, truth.a, 0.005);
          EXPECT_NEAR(fit.ellipse.b, truth.b, 0.005);
          EXPECT_NEAR(fit.blur_px, blur, 0.005);
          EXPECT_NEAR(fit.inside, 0.1, 0.005);
          EXPECT_NEAR(fit.outside, 0.9, 0.005);
          EXPECT_EQ(fit.visible, 1);
        }
}

TEST(FitEllipse, CovarianceOfTheShape) {
  std::mt19937_64 random(4);
  const EllipseScene scene = test::scene_of(14, 0.6, 0.5, 0.8, random);
  const std::vector<double> values = render(scene);
  const Ellipse& truth = scene.ellipses[0].ellipse;
  double sum = 0;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    const EllipseFit fit = fit_ellipse(noisy_plane(scene, values, {64e-6, 0}, random), truth);
    ASSERT_EQ(fit.state, EllipseState::good);
    const Eigen::Matrix2d q = fit.ellipse.shape() - truth.shape();
    Eigen::Matrix<double, 5, 1> error;
    error << fit.ellipse.center - truth.center, q(0, 0), q(0, 1), q(1, 1);
    sum += error.dot(fit.covariance.inverse() * error) / count;
  }
  EXPECT_NEAR(sum, 5, 0.6);
}

TEST(FitEllipse, LargeCirclesAndWhiteOnBlack) {
  std::mt19937_64 random(6);
  EllipseScene scene = test::scene_of(240, 0.9, 0.5, 1.2, random);
  scene.paper = 0.2;
  scene.ellipses[0].value = 0.8;
  const LightPlane plane = noisy_plane(scene, render(scene), {64e-6, 0}, random);
  const EllipseFit fit = fit_ellipse(plane, test::rough_guess(scene.ellipses[0].ellipse, random));
  ASSERT_EQ(fit.state, EllipseState::good);
  const Eigen::Vector2d error = fit.ellipse.center - scene.ellipses[0].ellipse.center;
  EXPECT_LT(error.dot(fit.center_covariance().inverse() * error), 14);
  EXPECT_LT(fit.center_covariance().trace(), 0.003 * 0.003);
}

TEST(FitEllipse, HiddenPartsAreLeftOutOrRefused) {
  for (const double minor : {12.0, 30.0})
    for (const double value : {0.1, 0.5, 0.9}) {
      std::mt19937_64 random(5);
      int good = 0, count = 0, wrong = 0;
      double sum = 0;
      for (const double hidden : {-0.1, 0.1, 0.4, 1.0})  // of the radius
        for (int i = 0; i < 8; ++i) {
          EllipseScene scene = test::scene_of(minor, i % 2 ? 0.7 : 1, 0.37 * i, 0.8, random);
          const Ellipse& truth = scene.ellipses[0].ellipse;
          scene.bars.push_back({truth.center.x() + truth.b * (1 - hidden), 0, 1000, 1000, value});
          const EllipseFit fit =
              fit_ellipse(noisy_plane(scene, render(scene), {64e-6, 0}, random), test::rough_guess(truth, random));
          ++count;
          if (fit.state != EllipseState::good) continue;
          const Eigen::Vector2d error = fit.ellipse.center - truth.center;
          const double square = error.dot(fit.center_covariance().inverse() * error);
          ++good;
          wrong += square > 25;
          sum += square;
          EXPECT_GE(fit.visible, 0.6);
        }
      std::printf("%2.0f px behind %.1f: %d of %d measured, mahalanobis² %.2f, %d wrong\n", minor, value, good, count,
                  good > 0 ? sum / good : 0.0, wrong);
      EXPECT_EQ(wrong, 0);
      if (minor > 20) {
        EXPECT_GT(good, count / 4);
      }
    }
}

TEST(FitEllipse, NeighboursOfALattice) {
  // Gaps are as wide as the circles. Half of the neighbours are missing, so that nothing cancels.
  for (const double minor : {5.0, 8.0, 20.0}) {
    std::mt19937_64 random(12);
    double sum = 0;
    int count = 0, good = 0;
    for (int phase = 0; phase < 3; ++phase) {
      EllipseScene scene = test::scene_of(minor, 0.7, 0.7 * phase, minor < 6 ? 0.7 : 1, random);
      const Ellipse truth = scene.ellipses[0].ellipse;
      const Eigen::Vector2d right = 4 * (truth.point(0) - truth.center),
                            down = 4 * (truth.point(1.5707963) - truth.center);
      for (const Eigen::Vector2d& offset : {right, down, Eigen::Vector2d(right + down)}) {
        Ellipse other = truth;
        other.center += offset;
        scene.ellipses.push_back({other, 0.1});
      }
      const std::vector<double> values = render(scene);
      for (int i = 0; i < 60; ++i) {
        const EllipseFit fit =
            fit_ellipse(noisy_plane(scene, values, {64e-6, 0}, random), test::rough_guess(truth, random));
        ++count;
        if (fit.state != EllipseState::good) continue;
        const Eigen::Vector2d error = fit.ellipse.center - truth.center;
        ++good;
        sum += error.dot(fit.center_covariance().inverse() * error);
      }
    }
    std::printf("%2.0f px beside others: %d of %d, mahalanobis² %.2f\n", minor, good, count, sum / good);
    EXPECT_GE(good, 0.98 * count) << minor;
    EXPECT_LT(sum / good, 2.6) << minor;
  }
}

/// One colour a pixel (RGGB), the others from their neighbours' means, 8-bit sRGB.
Image demosaiced(const EllipseScene& scene, const std::vector<double>& values, double variance,
                 std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const int w = scene.width, h = scene.height;
  std::vector<double> raw(values);
  for (double& v : raw) v += std::sqrt(variance) * normal(random);
  const auto color = [](int x, int y) { return y % 2 == 0 ? (x % 2 == 0 ? 0 : 1) : (x % 2 == 0 ? 1 : 2); };
  Image photo(w, h, 3);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int c = 0; c < 3; ++c) {
        double sum = 0, weight = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int u = std::abs(x + dx) < w ? std::abs(x + dx) : w - 2,
                      v = std::abs(y + dy) < h ? std::abs(y + dy) : h - 2;
            const double share = color(x, y) == c   ? (dx == 0 && dy == 0)
                                 : color(u, v) == c ? (2 - std::abs(dx)) * (2 - std::abs(dy))
                                                    : 0;
            sum += share * raw[std::size_t(v * w + u)];
            weight += share;
          }
        photo.row<std::uint8_t>(y)[3 * x + c] =
            std::uint8_t(std::lround(255 * srgb_from_linear(float(std::clamp(sum / weight, 0.0, 1.0)))));
      }
  return photo;
}

TEST(FitEllipse, PhotographsThroughAColourFilter) {
  // Neighbours' noise is correlated, and the noise is not told but found in the photograph.
  std::mt19937_64 random(13);
  double sum = 0, square = 0, bound = 0, residual = 0;
  int good = 0, count = 0;
  for (int phase = 0; phase < 6; ++phase) {
    EllipseScene scene = test::scene_of(14, 0.8, 0.7 * phase, 0.9, random);
    scene.width = scene.height = 96;
    scene.fine = 4;
    scene.ellipses[0].ellipse.center += Eigen::Vector2d(20, 20);
    const Ellipse& truth = scene.ellipses[0].ellipse;
    const std::vector<double> values = render(scene);
    for (int i = 0; i < 40; ++i) {
      const LightPlane plane = light_plane(demosaiced(scene, values, 1e-4, random));
      const EllipseFit fit = fit_ellipse(plane, test::rough_guess(truth, random));
      ++count;
      if (fit.state != EllipseState::good) continue;
      const Eigen::Vector2d error = fit.ellipse.center - truth.center;
      ++good;
      square += error.squaredNorm();
      bound += fit.center_covariance().trace();
      sum += error.dot(fit.center_covariance().inverse() * error);
      residual += fit.residual;
    }
  }
  std::printf("colour filter: rms %.4f px, expected %.4f, mahalanobis² %.2f, residual %.2f, %d of %d\n",
              std::sqrt(square / good), std::sqrt(bound / good), sum / good, residual / good, good, count);
  EXPECT_GE(good, 0.95 * count);
  EXPECT_GT(sum / good, 1);
  EXPECT_LT(sum / good, 3);
}

TEST(FitEllipse, ClippedPaper) {
  for (const double paper : {1.0, 1.05, 1.3, 2.0}) {
    SCOPED_TRACE(paper);
    double squares = 0, sum = 0;
    int good = 0;
    constexpr int kTimes = 150;
    for (int i = 0; i < kTimes; ++i) {
      std::mt19937_64 random{std::uint64_t(i)};
      EllipseScene scene = test::scene_of(8 + i % 20, 0.6 + 0.004 * i, 0.006 * i, 0.8, random);
      scene.paper = paper;
      const LightPlane plane = noisy_plane(scene, render(scene), {64e-6, 0}, random);
      const Ellipse& truth = scene.ellipses[0].ellipse;
      const EllipseFit fit = fit_ellipse(plane, test::rough_guess(truth, random));
      if (fit.state != EllipseState::good) continue;
      ++good;
      const Eigen::Vector2d error = fit.ellipse.center - truth.center;
      squares += error.squaredNorm();
      sum += error.dot(fit.center_covariance().inverse() * error);
    }
    std::printf("paper %.2f of what is held: rms %.4f px, mahalanobis² %.2f, %d of %d\n", paper,
                std::sqrt(squares / good), sum / good, good, kTimes);
    EXPECT_GE(good, 0.97 * kTimes);
    EXPECT_LT(std::sqrt(squares / good), 0.02);
    EXPECT_LT(sum / good, 4);
    EXPECT_GT(sum / good, 1);
  }
}

TEST(FitEllipse, ClippedLight) {
  std::mt19937_64 random(7);
  EllipseScene scene = test::scene_of(16, 0.8, 0.3, 0.8, random);
  scene.paper = 1.2;  // all of the paper, where that is not wanted
  EllipseOptions options;
  options.max_saturated = 0.1;
  LightPlane plane = noisy_plane(scene, render(scene), {64e-6, 0}, random);
  EXPECT_EQ(fit_ellipse(plane, scene.ellipses[0].ellipse, options).state, EllipseState::saturated);
  // A highlight on it: left out.
  scene.paper = 0.8;
  std::vector<double> values = render(scene);
  const Eigen::Vector2d spot = scene.ellipses[0].ellipse.center + Eigen::Vector2d(12, 0);
  for (int y = 0; y < scene.height; ++y)
    for (int x = 0; x < scene.width; ++x)
      if ((Eigen::Vector2d(x + 0.5, y + 0.5) - spot).norm() < 3) values[std::size_t(y * scene.width + x)] = 2;
  plane = noisy_plane(scene, values, {64e-6, 0}, random);
  const EllipseFit fit = fit_ellipse(plane, scene.ellipses[0].ellipse);
  ASSERT_EQ(fit.state, EllipseState::good);
  const Eigen::Vector2d error = fit.ellipse.center - scene.ellipses[0].ellipse.center;
  EXPECT_LT(error.dot(fit.center_covariance().inverse() * error), 14);
}

TEST(FitEllipse, SaysWhyNot) {
  std::mt19937_64 random(8);
  EllipseScene scene = test::scene_of(12, 1, 0, 1, random);
  const Ellipse truth = scene.ellipses[0].ellipse;
  const std::vector<double> values = render(scene);
  const LightPlane plane = noisy_plane(scene, values, {64e-6, 0}, random);
  Ellipse guess = truth;
  guess.center.x() = 5;
  EXPECT_EQ(fit_ellipse(plane, guess).state, EllipseState::at_border);
  EXPECT_EQ(fit_ellipse(noisy_plane(scene, values, {0.06, 0}, random), truth).state, EllipseState::no_contrast);
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  for (const Ellipse& bad : {Ellipse{}, Ellipse{{nan, 0}, 5, 5, 0}, Ellipse{{15, 15}, inf, 5, 0},
                             Ellipse{{15, 15}, 5, -5, 0}, Ellipse{{15, 15}, 4, 5, 0}, Ellipse{{15, 15}, 5, 5, nan},
                             Ellipse{{1e300, 15}, 5, 5, 0}, Ellipse{{15, 15}, 1e6, 1, 0}}) {
    EXPECT_NE(fit_ellipse(plane, bad).state, EllipseState::good);
    EXPECT_NE(dual_conic_fit(plane, bad).state, EllipseState::good);
  }
  LightPlane tiny;
  tiny.values = Image(1, 1, 1, PixelType::f32);
  EXPECT_NE(fit_ellipse(tiny, truth).state, EllipseState::good);
  LightPlane broken = plane;
  for (int x = 0; x < scene.width; ++x) broken.values.row<float>(scene.height / 2)[x] = float(nan);
  EXPECT_NO_THROW(fit_ellipse(broken, truth));
  EllipseOptions options;
  options.min_visible = 2;
  EXPECT_EQ(test::expect_error([&] { fit_ellipse(plane, truth, options); }).code(), ErrorCode::invalid_argument);
}

TEST(FitEllipse, DoesNotBelieveWhatIsNone) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> part(0, 1);
  int good = 0, squares = 0, count = 0;
  for (int kind = 0; kind < 5; ++kind)
    for (int i = 0; i < 40; ++i) {
      EllipseScene scene;
      scene.width = scene.height = 48;
      scene.fine = 4;
      scene.blur_px = 0.5 + part(random);
      const double side = 8 + 8 * part(random), x = 24 + part(random), y = 24 + part(random);
      const auto bar = [&](double x0, double y0, double x1, double y1) { scene.bars.push_back({x0, y0, x1, y1, 0.1}); };
      if (kind == 0) bar(x - side / 2, y - side / 2, x + side / 2, y + side / 2);  // a square
      if (kind == 1) bar(0, 0, x, y), bar(x, y, 48, 48);                           // a chessboard's corner
      if (kind == 2) bar(x - side / 2, 0, x, 48);                                  // a stripe
      if (kind == 3) bar(x - side, y - 2, x + side, y + 2), bar(x - 2, y - side, x + 2, y + side);  // a cross
      if (kind == 4)                                                                                // letters
        for (int k = 0; k < 12; ++k) {
          const double u = 48 * part(random), v = 48 * part(random);
          bar(u, v, u + 2 + 6 * part(random), v + 1.5 + 4 * part(random));
        }
      const Ellipse guess{{24 + part(random), 24 + part(random)}, 0.55 * side + 1, 0.55 * side, part(random)};
      const EllipseFit fit = fit_ellipse(noisy_plane(scene, render(scene), {64e-6, 0}, random), guess);
      ++count;
      if (fit.state != EllipseState::good) continue;
      (kind == 0 ? squares : good) += 1;
      std::printf("kind %d: residual %.2f visible %.2f\n", kind, fit.residual, fit.visible);
    }
  EXPECT_EQ(good, 0) << "of " << count;
  EXPECT_LE(squares, 2);  // a square of 8 px, blurred, differs from an ellipse by less than JPEG changes one
}

}  // namespace
}  // namespace lumihull::calib
