// Silhouettes of pictures: conversion rules, soft edges against known coverage, cleaning.
#include <lumihull/calib/key_image.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "support.h"

namespace lumihull::calib {
namespace {

using test::expect_error;

const Rgb kGreen{60, 170, 80}, kRed{190, 60, 40};

/// Background samples around green.
ColorKey green_key() {
  std::mt19937 random(1);
  std::vector<Rgb> samples(5000, kGreen);
  for (Rgb& c : samples)
    for (std::uint8_t& v : c) v = std::uint8_t(v + random() % 13 - 6);
  Job job;
  return ColorKey::train(samples, {}, job);
}

/// A red disc before green with exact coverage (16 x 16 samples a pixel) and noise.
struct Disc {
  Image photo, coverage;
  double area;
};

Disc disc(double cx, double cy, double radius, int noise) {
  Disc d{Image(128, 120, 3), Image(128, 120, 1, PixelType::f32), M_PI * radius * radius};
  std::mt19937 random(7);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 128; ++x) {
      int inside = 0;
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i) inside += std::hypot(x + (i + 0.5) / 16 - cx, y + (j + 0.5) / 16 - cy) < radius;
      const double a = inside / 256.0;
      d.coverage.row<float>(y)[x] = float(a);
      for (std::size_t c = 0; c < 3; ++c) {
        const double jitter = noise ? double(random() % unsigned(2 * noise + 1)) - noise : 0;
        d.photo.row<std::uint8_t>(y)[3 * std::size_t(x) + c] =
            std::uint8_t(std::lround(a * kRed[c] + (1 - a) * kGreen[c] + jitter));
      }
    }
  return d;
}

TEST(KeyImage, SoftEdgesThresholdToThePureDecision) {
  const ColorKey key = green_key();
  std::mt19937 random(3);
  for (int trial = 0; trial < 6; ++trial) {
    Disc d = disc(40 + 7.3 * trial, 55.2, 30, 4);
    // Specks, stripes and lines at all borders too.
    for (int i = 0; i < 300; ++i) {
      std::uint8_t* p = d.photo.row<std::uint8_t>(int(random() % 120)) + 3 * (random() % 128);
      for (int c = 0; c < 3; ++c) p[c] = std::uint8_t(random());
    }
    const Image hard = key_image(key, d.photo, {EdgeMode::hard, 0, 0}),
                soft = key_image(key, d.photo, {EdgeMode::soft, 0, 0});
    int between = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 128; ++x) {
        const std::uint8_t* p = d.photo.row<std::uint8_t>(y) + 3 * x;
        const int h = hard.row<std::uint8_t>(y)[x], s = soft.row<std::uint8_t>(y)[x];
        ASSERT_EQ(h, key.is_object({p[0], p[1], p[2]}) ? 255 : 0);
        ASSERT_EQ(s >= 128, h == 255) << x << ' ' << y;
        between += s != h;
      }
    EXPECT_GT(between, 50);
  }
}

TEST(KeyImage, MatteFindsTheCoverageOfADisc) {
  const ColorKey key = green_key();
  for (const int noise : {0, 4}) {
    for (int trial = 0; trial < 5; ++trial) {
      const Disc d = disc(60.1 + 0.23 * trial, 58.7 - 0.31 * trial, 35.3 + 0.4 * trial, noise);
      const Image alpha = key_image(key, d.photo, {EdgeMode::matte, 0, 0});
      double error = 0, area = 0;
      int edge = 0;
      for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 128; ++x) {
          const double truth = d.coverage.row<float>(y)[x], got = alpha.row<std::uint8_t>(y)[x] / 255.0;
          area += got;
          if (truth > 0 && truth < 1)
            error += std::abs(got - truth), ++edge;
          else
            EXPECT_NEAR(got, truth, 0.15);
        }
      EXPECT_LT(error / edge, noise ? 0.05 : 0.02) << noise;
      // As a shift of the contour: hundredths of a pixel.
      EXPECT_LT(std::abs(area - d.area) / std::sqrt(4 * M_PI * d.area), noise ? 0.05 : 0.02) << noise;
    }
  }
}

TEST(KeyImage, AShinyRimHardlyMovesAnEdgeThatIsKnown) {
  // The disc's rim mirrors the green behind it, four pixels deep.
  Disc d = disc(60.1, 58.7, 35.3, 2);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 128; ++x) {
      const double depth = std::max(0.0, 35.3 - std::hypot(x + 0.5 - 60.1, y + 0.5 - 58.7));
      const double mirrored = d.coverage.row<float>(y)[x] * 0.5 * std::exp(-depth / 2);
      std::uint8_t* p = d.photo.row<std::uint8_t>(y) + 3 * x;
      for (std::size_t c = 0; c < 3; ++c)
        p[c] = std::uint8_t(std::lround((1 - mirrored) * p[c] + mirrored * kGreen[c]));
    }
  Image mask(128, 120, 1);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 128; ++x) mask.row<std::uint8_t>(y)[x] = d.coverage.row<float>(y)[x] >= 0.5f ? 255 : 0;
  soften_edges(mask, d.photo, EdgeMode::matte);
  double area = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 128; ++x) area += mask.row<std::uint8_t>(y)[x] / 255.0;
  EXPECT_NEAR((area - d.area) / std::sqrt(4 * M_PI * d.area), 0, 0.25);
}

TEST(KeyImage, DeeperPicturesAreKeyedByTheRoundingRule) {
  const ColorKey key = green_key();
  Image deep(256, 4, 3, PixelType::u16), real(256, 4, 3, PixelType::f32);
  std::mt19937 random(5);
  for (int y = 0; y < 4; ++y)
    for (int i = 0; i < 256 * 3; ++i) {
      deep.row<std::uint16_t>(y)[i] = std::uint16_t(random());
      real.row<float>(y)[i] = float(random() % 100000) / 99999;
    }
  const std::uint16_t edges[] = {0, 128, 129, 385, 386, 65535, 65407, 65406};
  std::copy(std::begin(edges), std::end(edges), deep.row<std::uint16_t>(0));
  const float odd[] = {-1, 2, std::nanf(""), INFINITY, -INFINITY, 0.5f / 255, 0.49f / 255, 1};
  std::copy(std::begin(odd), std::end(odd), real.row<float>(0));
  const Image d8 = keyable(deep), r8 = keyable(real);
  for (int y = 0; y < 4; ++y)
    for (int i = 0; i < 256 * 3; ++i) {
      ASSERT_EQ(d8.row<std::uint8_t>(y)[i], std::lround(deep.row<std::uint16_t>(y)[i] / 257.0));
      if (y > 0 || i > 7) {
        ASSERT_NEAR(r8.row<std::uint8_t>(y)[i], real.row<float>(y)[i] * 255.0, 0.501);
      }
    }
  const int expected[] = {0, 255, 0, 255, 0, 1, 0, 255};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(r8.row<std::uint8_t>(0)[i], expected[i]) << i;
  for (const auto& [source, eight] : {std::pair{&deep, &d8}, std::pair{&real, &r8}}) {
    const Image a = key_image(key, *source), b = key_image(key, *eight);
    EXPECT_TRUE(std::equal(a.data(), a.data() + a.bytes(), b.data()));
  }
  EXPECT_EQ(expect_error([&] { key_image(key, Image(8, 8, 1)); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([&] {
              key_image(key, Image(8, 8, 3), {EdgeMode::hard, -1, 0});
            }).code(),
            ErrorCode::invalid_argument);
}

/// Components by flood fill, one pixel at a time.
Image cleaned_plainly(const Image& mask, int smallest, int hole) {
  Image out = mask;
  const int width = mask.width(), height = mask.height();
  for (const bool object : {true, false}) {
    std::vector<char> seen(std::size_t(width) * std::size_t(height), 0);
    const Image before = out;
    for (int start = 0; start < width * height; ++start) {
      const auto is = [&](int i) { return (before.row<std::uint8_t>(i / width)[i % width] >= 128) == object; };
      if (seen[std::size_t(start)] || !is(start)) continue;
      std::vector<int> part{start};
      seen[std::size_t(start)] = 1;
      bool border = false;
      for (std::size_t i = 0; i < part.size(); ++i) {
        const int x = part[i] % width, y = part[i] / width;
        border |= x == 0 || y == 0 || x == width - 1 || y == height - 1;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            if ((!object && dx && dy) || x + dx < 0 || y + dy < 0 || x + dx >= width || y + dy >= height) continue;
            const int at = (y + dy) * width + x + dx;
            if (seen[std::size_t(at)] || !is(at)) continue;
            seen[std::size_t(at)] = 1;
            part.push_back(at);
          }
      }
      if (object ? int(part.size()) >= smallest : (border || int(part.size()) > hole)) continue;
      for (const int i : part) out.row<std::uint8_t>(i / width)[i % width] = object ? 0 : 255;
    }
  }
  return out;
}

TEST(KeyImage, CleaningIsTheFloodFillsAnswer) {
  std::mt19937 random(11);
  for (const int width : {1, 5, 63, 64, 65, 130}) {
    for (const unsigned density : {20u, 45u, 60u, 85u}) {
      Image mask(width, 70, 1);
      for (int y = 0; y < 70; ++y)
        for (int x = 0; x < width; ++x) mask.row<std::uint8_t>(y)[x] = random() % 100 < density ? 255 : 0;
      const Image expected = cleaned_plainly(mask, 6, 4);
      Image got = mask;
      clean_mask(got, 6, 4);
      ASSERT_TRUE(std::equal(got.data(), got.data() + got.bytes(), expected.data())) << width << ' ' << density;
    }
  }
}

}  // namespace
}  // namespace lumihull::calib
