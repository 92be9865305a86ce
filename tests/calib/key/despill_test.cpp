// The enclosure's light is taken off, whatever its hue, and nothing else is.
#include <lumihull/calib/despill.h>

#include <cmath>
#include <random>

#include "support.h"

namespace lumihull::calib {
namespace {

std::vector<ColorCount> samples(Rgb center) {
  std::mt19937 random(2);
  std::vector<Rgb> list(2000, center);
  for (Rgb& c : list) {
    const double light = 0.5 + 0.5 * double(random() % 1000) / 1000;
    for (std::uint8_t& v : c) v = std::uint8_t(v * light);
  }
  return count_colors(list);
}

TEST(Despill, IsTheUsualLimitForPureHues) {
  const Despill green(samples({0, 220, 0})), blue(samples({0, 0, 220}));
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3f c(float(random() % 256), float(random() % 256), float(random() % 256));
    EXPECT_NEAR(green(c, SpillMode::limit).y(), std::min(c.y(), (c.x() + c.z()) / 2), 1e-3);
    EXPECT_NEAR(blue(c, SpillMode::limit).z(), std::min(c.z(), (c.x() + c.y()) / 2), 1e-3);
  }
}

TEST(Despill, HoldsForEnclosuresOfAnyHue) {
  for (const Rgb hue : {Rgb{60, 170, 80}, Rgb{70, 80, 190}, Rgb{200, 40, 60}, Rgb{40, 180, 190}, Rgb{190, 60, 180},
                        Rgb{200, 190, 50}}) {
    const Despill despill(samples(hue));
    ASSERT_FALSE(despill.neutral());
    EXPECT_NEAR(despill.axis().norm(), 1, 1e-5);
    EXPECT_NEAR(despill.axis().sum(), 0, 1e-5);
    std::mt19937 random(1);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3f c(float(random() % 256), float(random() % 256), float(random() % 256));
      const Eigen::Vector3f grey = Eigen::Vector3f::Constant(float(random() % 256));
      for (const SpillMode mode : {SpillMode::limit, SpillMode::desaturate}) {
        const Eigen::Vector3f out = despill(c, mode);
        EXPECT_LE(despill.axis().dot(out), std::max(despill.axis().dot(c), 0.0f) + 1e-3f);
        EXPECT_EQ(despill(c, mode, 0), c);
        EXPECT_EQ(despill(grey, mode), grey);
        if (despill.axis().dot(c) <= 0) {
          EXPECT_EQ(out, c);
        }
      }
      const Eigen::Vector3f limited = despill(c, SpillMode::limit);
      EXPECT_TRUE((limited.array() <= c.array()).all());
      EXPECT_TRUE((limited.array() >= 0).all());
    }
    // The enclosure's own colour ends without its hue, one opposite to it stays.
    const Eigen::Vector3f own(hue[0], hue[1], hue[2]);
    EXPECT_LT(despill.axis().dot(despill(own, SpillMode::limit)), 1e-2);
    const Eigen::Vector3f gray = despill(own, SpillMode::desaturate);
    EXPECT_LT(gray.maxCoeff() - gray.minCoeff(), 1e-2);
    const Eigen::Vector3f opposite = Eigen::Vector3f::Constant(255) - own;
    EXPECT_EQ(despill(opposite, SpillMode::desaturate), opposite);
  }
}

TEST(Despill, AnEnclosureOfTwoOppositeHuesStaysFinite) {
  for (int v = 100; v < 250; ++v) {
    const auto g = std::uint8_t(v), m = std::uint8_t(350 - v);
    const std::vector<ColorCount> both{{{0, g, 0}, 90}, {{m, 0, m}, 10}};
    const Despill despill(both);
    ASSERT_FALSE(despill.neutral());
    EXPECT_TRUE(despill({90, 120, 60}, SpillMode::desaturate).allFinite()) << v;
  }
}

TEST(Despill, AGreyEnclosureBleedsNoHue) {
  Image photo(4, 4, 3);
  for (std::size_t i = 0; i < photo.bytes(); ++i) photo.data()[i] = std::byte(i * 5);
  const Image before = photo;
  const Despill despill(samples({90, 91, 90}));
  EXPECT_TRUE(despill.neutral());
  despill.apply(photo, SpillMode::limit);
  EXPECT_TRUE(std::equal(photo.data(), photo.data() + photo.bytes(), before.data()));
  EXPECT_EQ(test::expect_error([] { Despill none{std::span<const ColorCount>()}; }).code(),
            ErrorCode::invalid_argument);
}

TEST(Despill, PicturesOfAllTypesAgree) {
  const Despill despill(samples({60, 170, 80}));
  Image eight(64, 8, 4), sixteen(64, 8, 4, PixelType::u16), real(64, 8, 4, PixelType::f32);
  std::mt19937 random(1);
  for (int y = 0; y < 8; ++y)
    for (int i = 0; i < 256; ++i) {
      const int v = int(random() % 256);
      eight.row<std::uint8_t>(y)[i] = std::uint8_t(v);
      sixteen.row<std::uint16_t>(y)[i] = std::uint16_t(257 * v);
      real.row<float>(y)[i] = float(v) / 255;
    }
  const Image before = eight;
  for (Image* image : {&eight, &sixteen, &real}) despill.apply(*image, SpillMode::limit);
  for (int y = 0; y < 8; ++y)
    for (int i = 0; i < 256; ++i) {
      EXPECT_NEAR(eight.row<std::uint8_t>(y)[i], sixteen.row<std::uint16_t>(y)[i] / 257.0, 0.51);
      EXPECT_NEAR(eight.row<std::uint8_t>(y)[i], real.row<float>(y)[i] * 255, 0.51);
      if (i % 4 == 3) {
        EXPECT_EQ(eight.row<std::uint8_t>(y)[i], before.row<std::uint8_t>(y)[i]);
      }
    }
  EXPECT_EQ(test::expect_error([&] { despill.apply(eight, SpillMode::limit, 2); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
