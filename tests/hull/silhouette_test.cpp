#include <lumihull/hull/region.h>
#include <lumihull/hull/silhouette.h>
#include <support.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "synthetic.h"

namespace lumihull {
namespace {

using hull::Silhouette;

Image disc(int width, int height, double x, double y, double radius) {
  Image mask(width, height, 1);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      int n = 0;
      for (int s = 0; s < 256; ++s) n += std::hypot(i + (s % 16 + 0.5) / 16 - x, j + (s / 16 + 0.5) / 16 - y) < radius;
      mask.row<std::uint8_t>(j)[i] = std::uint8_t(std::lround(n * 255.0 / 256));
    }
  return mask;
}

TEST(Silhouette, HoldsTheDistanceToASoftMasksContour) {
  const Camera camera = test::pinhole(120, 90, 100);
  const Silhouette s = Silhouette::from_mask(disc(120, 90, 61.3, 44.8, 25.4), camera, {1, 8});
  double worst = 0;
  for (double v = 10; v < 80; v += 0.37)
    for (double u = 20; u < 100; u += 0.41) {
      const double truth = std::hypot(u - 61.3, v - 44.8) - 25.4;
      const auto d = s.distance(camera.distorted_from_pixel({u, v}));
      ASSERT_TRUE(d);
      if (std::abs(truth) < 6.5) worst = std::max(worst, std::abs(*d * camera.f - truth));
      if (std::abs(truth) > 9.6) {
        EXPECT_EQ(*d, std::copysign(s.band(), truth));
      }
    }
  EXPECT_LT(worst, 0.12);  // px: coverage interpolated linearly
  EXPECT_NEAR(s.band() * camera.f, 8, 1e-6);
}

TEST(Silhouette, ABinaryMasksContourRunsBetweenItsPixels) {
  const Camera camera = test::pinhole(64, 48, 50);
  Image mask(64, 48, 1);
  for (int y = 0; y < 48; ++y) std::fill_n(mask.row<std::uint8_t>(y), 30, std::uint8_t(255));
  const Silhouette s = Silhouette::from_mask(mask, camera);
  for (const double u : {25.0, 29.5, 30.0, 30.5, 33.0})
    EXPECT_NEAR(*s.distance(camera.distorted_from_pixel({u, 20.2})) * camera.f, u - 30, 1e-3);
  EXPECT_TRUE(s.bounds().touches_border);
}

TEST(Silhouette, CoarseCellsStayCloseToFineOnes) {
  const Camera camera = test::pinhole(400, 300, 300);
  const Image mask = disc(400, 300, 190, 160, 90);
  const Silhouette fine = Silhouette::from_mask(mask, camera, {1, 24}),
                   coarse = Silhouette::from_mask(mask, camera, {3, 24});
  EXPECT_LT(coarse.bytes(), fine.bytes() / 2);
  for (double v = 60; v < 260; v += 1.7)
    for (double u = 90; u < 290; u += 1.3) {
      if (std::abs(std::hypot(u - 190, v - 160) - 90) > 18) continue;
      const Eigen::Vector2d p = camera.distorted_from_pixel({u, v});
      // A voxel is 12 px wide here: 0.05 of it.
      EXPECT_NEAR(*fine.distance(p) * camera.f, *coarse.distance(p) * camera.f, 0.6);
    }
}

TEST(Silhouette, ALensCarriesTheContourExactly) {
  // A straight world line, seen through a strong lens: its field is still that of a straight line.
  Camera camera = test::pinhole(200, 160, 150);
  camera.k1 = -0.25, camera.k2 = 0.05, camera.p1 = 0.004, camera.p2 = -0.003;
  camera.s = 1.3, camera.skew = 7;
  Image mask(200, 160, 1);
  const auto side = [](const Eigen::Vector2d& ideal) { return 0.8 * ideal.x() + 0.6 * ideal.y() - 0.11; };
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 200; ++x) {
      int n = 0;
      for (int s = 0; s < 256; ++s) {
        const auto ray = camera.ray({x + (s % 16 + 0.5) / 16, y + (s / 16 + 0.5) / 16});
        n += ray && side(ray->head<2>()) < 0;
      }
      mask.row<std::uint8_t>(y)[x] = std::uint8_t(std::lround(n * 255.0 / 256));
    }
  const Silhouette s = Silhouette::from_mask(mask, camera, {1, 8});
  int compared = 0;
  for (double v = 5; v < 155; v += 3.1)
    for (double u = 5; u < 195; u += 2.7) {
      const Eigen::Vector2d ideal = camera.ray({u, v})->head<2>();
      const double truth = side(ideal);
      if (std::abs(truth) > 5 / 195.0) continue;
      const auto d = s.distance(ideal);
      ASSERT_TRUE(d) << u << ' ' << v;
      EXPECT_NEAR(*d * 195, truth * 195, 0.15) << u << ' ' << v;  // finest pixels: f s = 195
      ++compared;
    }
  EXPECT_GT(compared, 200);
}

TEST(Silhouette, SaysNothingBeyondThePicture) {
  Camera camera = test::pinhole(80, 60, 60);
  Image full(80, 60, 1);
  std::fill_n(full.row<std::uint8_t>(0), 80 * 60, std::uint8_t(255));
  const Silhouette plain = Silhouette::from_mask(full, camera);
  EXPECT_TRUE(plain.is_full());
  EXPECT_LT(*plain.distance({0, 0}), 0);
  EXPECT_LT(*plain.distance(camera.distorted_from_pixel({79.5, 0.5})), 0);  // the border is no contour
  EXPECT_FALSE(plain.distance(camera.distorted_from_pixel({80.5, 30})));
  EXPECT_FALSE(plain.distance(camera.distorted_from_pixel({-0.5, 30})));
  camera.k1 = 0.2;
  const Silhouette lens = Silhouette::from_mask(full, camera);
  for (double v = -20; v < 80; v += 0.9)
    for (double u = -20; u < 100; u += 1.1) {
      const Eigen::Vector2d ideal = camera.correct(camera.distorted_from_pixel({u, v}));
      const bool in = u >= 0 && v >= 0 && u <= 80 && v <= 60;
      if (!in) {
        EXPECT_FALSE(lens.distance(ideal)) << u << ' ' << v;
      }
      // Cells that the border cuts don't count as seen.
      if (u > 2 && v > 2 && u < 78 && v < 58) {
        EXPECT_TRUE(lens.distance(ideal)) << u << ' ' << v;
      }
    }
}

TEST(Silhouette, RefusesWhatIsNoMask) {
  const Camera camera = test::pinhole(80, 60, 60);
  EXPECT_EQ(test::expect_error([&] { Silhouette::from_mask(Image(80, 61, 1), camera); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(test::expect_error([&] { Silhouette::from_mask(Image(80, 60, 3), camera); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(test::expect_error([&] { Silhouette::from_mask(Image(80, 60, 1, PixelType::u16), camera); }).code(),
            ErrorCode::bad_input);
  EXPECT_EQ(test::expect_error([&] {
              Silhouette::from_mask(Image(80, 60, 1), camera, {0.5, 8});
            }).code(),
            ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] {
              Silhouette::from_mask(Image(80, 60, 1), camera, {1, std::numeric_limits<double>::quiet_NaN()});
            }).code(),
            ErrorCode::invalid_argument);
  EXPECT_TRUE(Silhouette::from_mask(Image(80, 60, 1), camera).is_empty());
}

}  // namespace
}  // namespace lumihull
