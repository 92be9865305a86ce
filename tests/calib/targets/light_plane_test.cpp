// Linear light, clipping, and the noise that is found in a picture against the noise that was put in.
#include <lumihull/calib/light_plane.h>

#include <cmath>
#include <random>

#include "ellipse_picture.h"
#include "support.h"

namespace lumihull::calib {
namespace {

/// A grey or colour photograph of linear values with noise, rounded to 8-bit sRGB.
Image photograph(int width, int height, int channels, const std::function<double(int, int)>& linear, double read,
                 double gain, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Image photo(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) {
        const double v = linear(x, y), n = v + std::sqrt(read + gain * v) * normal(random);
        photo.row<std::uint8_t>(y)[x * channels + c] =
            std::uint8_t(std::lround(255 * srgb_from_linear(float(std::clamp(n, 0.0, 1.0)))));
      }
  return photo;
}

TEST(LightPlane, IsTheWeightedSumOfLinearChannels) {
  std::mt19937 random(1);
  for (const PixelType type : {PixelType::u8, PixelType::u16, PixelType::f32}) {
    for (const int channels : {1, 3, 4}) {
      Image photo(37, 5, channels, PixelType::f32);
      for (int y = 0; y < 5; ++y)
        for (int i = 0; i < 37 * channels; ++i) photo.row<float>(y)[i] = float(random() % 250) / 255;
      photo = converted(photo, type, channels);
      const Eigen::Vector3f weights(0.5f, -0.2f, 0.3f);
      const LightPlane plane = light_plane(photo, weights);
      const Image same = converted(photo, PixelType::f32, channels);
      for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 37; ++x) {
          float expected = 0;
          for (int c = 0; c < std::min(channels, 3); ++c)
            expected += (channels == 1 ? 1 : weights[c]) * linear_from_srgb(same.row<float>(y)[channels * x + c]);
          EXPECT_NEAR(plane.values.row<float>(y)[x], expected, 2e-5);
        }
    }
  }
}

TEST(LightPlane, ClippedPixelsAreAtSaturation) {
  Image photo(4, 1, 3);
  const std::uint8_t values[12] = {255, 0, 0, 254, 254, 254, 10, 10, 255, 0, 255, 0};
  std::copy_n(values, 12, photo.row<std::uint8_t>(0));
  const LightPlane plane = light_plane(photo, {.6f, .39f, .01f});
  const float* v = plane.values.row<float>(0);
  EXPECT_GE(v[0], plane.saturation);
  EXPECT_LT(v[1], plane.saturation);
  EXPECT_LT(v[2], plane.saturation);  // blue hardly counts
  EXPECT_GE(v[3], plane.saturation);
}

TEST(LightPlane, NoiseOfFlatPictures) {
  for (const double sigma : {0.003, 0.01, 0.05})
    for (const int channels : {1, 3}) {
      const LightPlane plane = light_plane(photograph(
                                               400, 300, channels, [](int, int) { return 0.5; }, sigma * sigma, 0, 7),
                                           {1, 1, 1});
      const double expected = std::sqrt((sigma * sigma + 2.3e-6) / channels);
      EXPECT_NEAR(std::sqrt(plane.noise.variance(0.5)) / expected, 1, 0.15) << sigma << " " << channels;
    }
}

TEST(LightPlane, NoiseThatGrowsWithTheLight) {
  const auto ramp = [](int x, int) { return 0.05 + 0.8 * x / 800.0; };
  const LightPlane plane = light_plane(photograph(800, 400, 1, ramp, 2e-5, 4e-4, 3));
  for (const double v : {0.1, 0.3, 0.6, 0.8})
    EXPECT_NEAR(std::sqrt(plane.noise.variance(v) / (2e-5 + 4e-4 * v)), 1, 0.15) << v;
}

TEST(LightPlane, NoiseOfPicturesFullOfCircles) {
  for (const double pitch : {12.0, 30.0}) {
    const auto circles = [&](int x, int y) {
      const double u = std::remainder(x, pitch), v = std::remainder(y, pitch), d = std::hypot(u, v) - 0.25 * pitch;
      return 0.1 + 0.7 * 0.5 * (1 + std::erf(d / 1.4));
    };
    const LightPlane plane = light_plane(photograph(800, 600, 1, circles, 1e-4, 1e-4, 5));
    for (const double v : {0.1, 0.8}) {
      const double ratio = std::sqrt(plane.noise.variance(v) / (1e-4 + 1e-4 * v));
      EXPECT_GT(ratio, 0.85) << pitch << " " << v;
      // Where nothing is flat (small circles; all dark places) noise may be taken for larger than it is.
      EXPECT_LT(ratio, pitch < 20 ? 2.5 : v < 0.5 ? 1.4 : 1.15) << pitch << " " << v;
    }
  }
}

TEST(LightPlane, RoundingIsTheLeastNoise) {
  const LightPlane plane = light_plane(photograph(
      200, 200, 1, [](int, int) { return 0.7; }, 0, 0, 1));
  const double step = 2.4 / 1.055 * std::pow(0.7, 1.4 / 2.4) / 255;
  EXPECT_NEAR(std::sqrt(plane.noise.variance(0.7)), step / std::sqrt(12), 0.1 * step);
}

TEST(LightPlane, DoesNotDependOnThreads) {
  const Image photo = photograph(
      300, 300, 3, [](int x, int y) { return 0.2 + 0.001 * x + 0.0005 * y; }, 1e-4, 0, 1);
  Job one({}, 1), four({}, 4);
  const LightPlane a = light_plane(photo, {1, 1, 1}, one), b = light_plane(photo, {1, 1, 1}, four);
  EXPECT_EQ(0, std::memcmp(a.values.data(), b.values.data(), a.values.bytes()));
  EXPECT_EQ(a.noise.read, b.noise.read);
}

TEST(LightPlane, BadInput) {
  EXPECT_EQ(test::expect_error([] { light_plane(Image()); }).code(), ErrorCode::invalid_argument);
  const float nan = std::nanf("");
  EXPECT_EQ(test::expect_error([&] { light_plane(Image(2, 2, 3), {nan, 0, 0}); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { light_plane(Image(2, 2, 3), {0, 0, 0}); }).code(), ErrorCode::invalid_argument);
  Image bad(20, 20, 1, PixelType::f32);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x) bad.row<float>(y)[x] = (x + y) % 3 ? nan : -1e30f;
  const LightPlane plane = light_plane(bad);
  EXPECT_TRUE(std::isfinite(plane.values.row<float>(3)[3]));
  EXPECT_GT(plane.noise.read, 0);
  EXPECT_NO_THROW(light_plane(Image(1, 1, 4)));
}

TEST(LightPlane, ContrastWeightsSeparateInkFromPaper) {
  const Eigen::Vector3f w = contrast_weights({0.1f, 0.2f, 0.1f}, {0.4f, 0.9f, 0.2f});
  EXPECT_NEAR(w.cwiseAbs().sum(), 1, 1e-6);
  EXPECT_GT(w.y(), w.x());
  EXPECT_TRUE(contrast_weights({.3f, .3f, .3f}, {.3f, .3f, .3f}).allFinite());
}

}  // namespace
}  // namespace lumihull::calib
