#include <lumihull/slf/metrics.h>

#include <algorithm>
#include <cmath>

#include "support.h"

namespace lumihull {
namespace {

struct Pair {
  Image a{40, 32, 3}, b{40, 32, 3}, disc{40, 32, 1};
};

/// Integer formulas, so that another program can make the same pictures.
Pair pictures() {
  Pair p;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int a = (x * 7 + y * 13 + c * 31 + (x * y) % 17 * 5) / 2 % 256;
        p.a.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(a);
        p.b.row<std::uint8_t>(y)[3 * x + c] =
            std::uint8_t(std::clamp(a + (x * 3 + y * 5 + c * 2) % 11 * 4 - 20, 0, 255));
      }
      p.disc.row<std::uint8_t>(y)[x] = (x - 22) * (x - 22) + (y - 14) * (y - 14) < 200 ? 128 : 127;
    }
  return p;
}

// The expected values come from scikit-image 0.19.3: structural_similarity(a, b, channel_axis=2, gaussian_weights=True,
// sigma=1.5, use_sample_covariance=False, data_range=255, full=True), its map averaged over the mask and the pixels
// five or more from the border; and from the definition of PSNR in NumPy.
TEST(Metrics, AgreeWithScikitImage) {
  const Pair p = pictures();
  EXPECT_NEAR(slf::psnr(p.a, p.b), 26.31819765096642, 1e-9);
  EXPECT_NEAR(slf::psnr(p.a, p.b, &p.disc), 26.32597722037147, 1e-9);
  EXPECT_NEAR(slf::ssim(p.a, p.b), 0.8578057073064683, 1e-9);
  EXPECT_NEAR(slf::ssim(p.a, p.b, &p.disc), 0.8650757726141666, 1e-9);
  const slf::PictureQuality q = slf::compare_pictures(p.a, p.b, p.disc);
  EXPECT_EQ(q.psnr, slf::psnr(p.a, p.b));
  EXPECT_EQ(q.ssim_inside, slf::ssim(p.a, p.b, &p.disc));
}

TEST(Metrics, IdenticalPicturesAndEmptyMasks) {
  const Pair p = pictures();
  EXPECT_EQ(slf::psnr(p.a, p.a), slf::kPsnrIdentical);
  EXPECT_NEAR(slf::ssim(p.a, p.a), 1, 1e-12);
  const Image nothing(40, 32, 1);
  EXPECT_TRUE(std::isnan(slf::psnr(p.a, p.b, &nothing)));
  EXPECT_TRUE(std::isnan(slf::ssim(p.a, p.b, &nothing)));
}

TEST(Metrics, OnePixelOfDifference) {
  Pair p = pictures();
  p.b = p.a;
  p.b.row<std::uint8_t>(3)[3 * 5 + 1] ^= 16;
  EXPECT_NEAR(slf::psnr(p.a, p.b), 10 * std::log10(255.0 * 255 * 40 * 32 * 3 / 256), 1e-9);
}

TEST(Metrics, SilhouetteIou) {
  Image a(10, 10, 1), b(10, 10, 1);
  EXPECT_EQ(slf::silhouette_iou(a, b), 1);
  for (int i = 0; i < 6; ++i) a.row<std::uint8_t>(2)[i] = 128;
  for (int i = 4; i < 10; ++i) b.row<std::uint8_t>(2)[i] = 255;
  b.row<std::uint8_t>(3)[0] = 127;
  EXPECT_DOUBLE_EQ(slf::silhouette_iou(a, b), 2.0 / 10);
}

TEST(Metrics, CompositingRoundsToNearest) {
  Image rgba(2, 1, 4);
  const std::uint8_t values[8] = {255, 0, 100, 128, 9, 9, 9, 0};
  std::copy(values, values + 8, rgba.row<std::uint8_t>(0));
  const Image out = slf::composited(rgba, {0, 255, 50});
  const std::uint8_t expected[6] = {128, 127, 75, 0, 255, 50};
  EXPECT_TRUE(std::equal(expected, expected + 6, out.row<std::uint8_t>(0)));
}

TEST(Metrics, Faults) {
  const Image a(20, 20, 3), narrow(19, 20, 3), grey(20, 20, 1), small(10, 20, 3), mask(20, 19, 1);
  const Image deep(20, 20, 3, PixelType::u16);
  for (const Image* other : {&narrow, &grey, &deep})
    EXPECT_EQ(test::expect_error([&] { slf::psnr(a, *other); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::ssim(small, small); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::psnr(a, a, &mask); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::silhouette_iou(grey, mask); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull
