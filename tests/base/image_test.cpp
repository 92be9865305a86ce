#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

using test::bytes_of;
using test::expect_error;
using test::pattern;

bool same(const Image& a, const Image& b) {
  return a.width() == b.width() && a.height() == b.height() && a.channels() == b.channels() && a.type() == b.type() &&
         std::memcmp(a.data(), b.data(), a.bytes()) == 0;
}

Image noise(int width, int height, int channels, PixelType type, unsigned seed) {
  Image image(width, height, channels, type);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image.bytes(); ++i) image.data()[i] = std::byte(random());
  return image;
}

TEST(Image, IsZeroWhenNewAndCopiesDeeply) {
  Image a(5, 3, 3, PixelType::u16);
  for (std::size_t i = 0; i < a.bytes(); ++i) ASSERT_EQ(a.data()[i], std::byte(0));
  a.row<std::uint16_t>(2)[14] = 77;
  Image b = a;
  b.row<std::uint16_t>(2)[14] = 78;
  EXPECT_EQ(a.row<std::uint16_t>(2)[14], 77);
  Image c = std::move(b);
  EXPECT_TRUE(b.empty());
  EXPECT_EQ(b.bytes(), 0u);
  EXPECT_EQ(c.row<std::uint16_t>(2)[14], 78);
  c = std::move(a);
  EXPECT_EQ(c.row<std::uint16_t>(2)[14], 77);
}

TEST(Image, RefusesImpossibleSizes) {
  for (const auto& [w, h, c] :
       {std::tuple{0, 5, 3}, {5, -1, 3}, {65501, 1, 1}, {1, 65501, 1}, {5, 5, 0}, {5, 5, 5}, {30000, 30000, 1}})
    EXPECT_EQ(expect_error([&, w = w, h = h, c = c] { Image(w, h, c); }).code(), ErrorCode::invalid_argument);
}

TEST(Png, RoundTripsEveryTypeAndChannelCount) {
  for (const PixelType type : {PixelType::u8, PixelType::u16})
    for (const int channels : {1, 3, 4})
      for (const int compression : {0, 1, 9}) {
        const Image image = noise(37, 23, channels, type, unsigned(channels));
        const std::string png = encode_png(image, {.compression = compression});
        EXPECT_TRUE(same(decode_image(bytes_of(png), "a.png"), image));
        const ImageInfo info = decode_image_info(bytes_of(png), "a.png");
        EXPECT_EQ(std::tuple(info.width, info.height, info.channels, info.type), std::tuple(37, 23, channels, type));
      }
}

TEST(Png, AgreesWithOpenCv) {
  const Image image = noise(61, 47, 3, PixelType::u16, 5);
  const std::string png = encode_png(image);
  const cv::Mat peer = cv::imdecode(std::vector<char>(png.begin(), png.end()), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(peer.type(), CV_16UC3);
  for (int y = 0; y < 47; ++y)
    for (int x = 0; x < 61; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(peer.at<cv::Vec3w>(y, x)[2 - c], image.row<std::uint16_t>(y)[3 * x + c]);
}

TEST(Png, ReadsPalettesLowDepthsGreyAlphaAndInterlacing) {
  for (const bool interlaced : {false, true}) {
    SCOPED_TRACE(interlaced);
    // 4-bit palette of three colours, the first one transparent.
    test::PngVariant palette{5,
                             2,
                             3,
                             4,
                             interlaced,
                             {std::string("\x01\x20\x10", 3), std::string("\x22\x11\x00", 3)},
                             {10, 20, 30, 40, 50, 60, 70, 80, 90},
                             {0}};
    const std::string coloured = test::write_variant(palette);
    const Image rgba = decode_image(bytes_of(coloured), "p.png");
    ASSERT_EQ(rgba.channels(), 4);
    EXPECT_EQ(decode_image_info(bytes_of(coloured), "p.png").channels, 4);
    const std::uint8_t* row = rgba.row<std::uint8_t>(0);
    EXPECT_EQ(std::vector<int>(row, row + 12), (std::vector<int>{10, 20, 30, 0, 40, 50, 60, 255, 70, 80, 90, 255}));
    const Image rgb = decode_image(bytes_of(coloured), "p.png", {.channels = 3});
    EXPECT_EQ(rgb.channels(), 3);
    EXPECT_EQ(rgb.row<std::uint8_t>(0)[8], 90);

    // 1-bit grey.
    test::PngVariant bits{10, 2, 0, 1, interlaced, {std::string("\xa0\x40", 2), std::string("\x00\x80", 2)}, {}, {}};
    const std::string bitmap = test::write_variant(bits);
    const Image grey = decode_image(bytes_of(bitmap), "b.png");
    ASSERT_EQ(grey.channels(), 1);
    const std::uint8_t* g = grey.row<std::uint8_t>(0);
    EXPECT_EQ(std::vector<int>(g, g + 10), (std::vector<int>{255, 0, 255, 0, 0, 0, 0, 0, 0, 255}));

    // 16-bit grey with alpha becomes RGBA; as one channel it is the grey.
    test::PngVariant alpha{2, 1, 4, 16, interlaced, {std::string("\x12\x34\xff\xff\x00\x01\x80\x00", 8)}, {}, {}};
    const std::string two = test::write_variant(alpha);
    const Image four = decode_image(bytes_of(two), "ga.png");
    ASSERT_EQ(four.channels(), 4);
    EXPECT_EQ(decode_image_info(bytes_of(two), "ga.png").channels, 4);
    const std::uint16_t* f = four.row<std::uint16_t>(0);
    EXPECT_EQ(std::vector<int>(f, f + 8), (std::vector<int>{0x1234, 0x1234, 0x1234, 0xffff, 1, 1, 1, 0x8000}));
    EXPECT_EQ(decode_image(bytes_of(two), "ga.png", {.channels = 1}).row<std::uint16_t>(0)[0], 0x1234);
  }
}

TEST(Jpeg, AgreesWithOpenCvBitForBit) {
  for (const int channels : {1, 3}) {
    const Image image = pattern(203, 119, channels);
    const std::string jpeg = encode_jpeg(image, 85);
    const Image ours = decode_image(bytes_of(jpeg), "a.jpg");
    const cv::Mat peer = cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(peer.channels(), channels);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        for (int c = 0; c < channels; ++c)
          ASSERT_EQ(ours.row<std::uint8_t>(y)[x * channels + c],
                    peer.ptr(y)[x * channels + (channels == 3 ? 2 - c : 0)]);
  }
}

TEST(Jpeg, KeepsChromaAtFullResolution) {
  // Columns of alternating saturated colours: with subsampled chroma they would mix to grey.
  Image image(64, 16, 3);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 64; ++x) image.row<std::uint8_t>(y)[3 * x + (x % 2 ? 2 : 0)] = 200;
  const std::string jpeg = encode_jpeg(image, 98);
  const Image back = decode_image(bytes_of(jpeg), "c.jpg");
  for (int x = 0; x < 64; ++x)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(back.row<std::uint8_t>(8)[3 * x + c], image.row<std::uint8_t>(8)[3 * x + c], 25) << x;
}

TEST(Jpeg, ReadsProgressiveAndConvertsChannels) {
  const Image image = pattern(80, 60, 3);
  cv::Mat mat(60, 80, CV_8UC3);
  std::memcpy(mat.data, image.data(), image.bytes());
  std::vector<unsigned char> buffer;
  cv::imencode(".jpg", mat, buffer, {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_QUALITY, 95});
  const std::string jpeg(buffer.begin(), buffer.end());
  const Image rgb = decode_image(bytes_of(jpeg), "p.jpg"),
              rgba = decode_image(bytes_of(jpeg), "p.jpg", {.channels = 4});
  ASSERT_EQ(rgb.channels(), 3);
  EXPECT_TRUE(same(rgba, converted(rgb, PixelType::u8, 4)));
  EXPECT_TRUE(same(decode_image(bytes_of(jpeg), "p.jpg", {.channels = 1}), converted(rgb, PixelType::u8, 1)));
  const std::string grey = encode_jpeg(pattern(30, 20, 1));
  const Image one = decode_image(bytes_of(grey), "g.jpg");
  EXPECT_TRUE(same(decode_image(bytes_of(grey), "g.jpg", {.channels = 3}), converted(one, PixelType::u8, 3)));
}

TEST(Exif, GivesWhatACameraWrites) {
  test::ExifBuilder exif;
  exif.ascii(false, 0x010f, "Lumi Cameras ");
  exif.ascii(false, 0x0110, "L-1");
  exif.u16(false, 0x0112, 6);
  exif.ascii(true, 0x9003, "2019:07:03 14:05:59");
  exif.rational(true, 0x920a, 505, 10);
  exif.u16(true, 0xa405, 75);
  exif.ascii(true, 0xa434, "50mm \xe9t\xe9");
  const std::string plain = encode_jpeg(pattern(40, 30, 3));
  const std::string jpeg = test::jpeg_with_exif(plain, exif.tiff());
  const test::TemporaryFolder folder;
  write_file(folder / "a.jpg", jpeg);
  for (const ImageInfo& info : {decode_image_info(bytes_of(jpeg), "a.jpg"), read_image_info(folder / "a.jpg")}) {
    EXPECT_EQ(info.width, 40);
    EXPECT_EQ(info.height, 30);
    EXPECT_EQ(info.channels, 3);
    EXPECT_EQ(info.orientation, 6);
    EXPECT_EQ(info.make, "Lumi Cameras");
    EXPECT_EQ(info.model, "L-1");
    EXPECT_EQ(info.lens, "50mm ?t?");
    EXPECT_EQ(info.time, "2019-07-03T14:05:59");
    ASSERT_TRUE(info.focal_length_mm && info.focal_length_35mm_mm);
    EXPECT_DOUBLE_EQ(*info.focal_length_mm, 50.5);
    EXPECT_DOUBLE_EQ(*info.focal_length_35mm_mm, 75);
  }
  // Pixels stay in the sensor's rows and columns unless asked for.
  const Image stored = read_image(folder / "a.jpg"),
              upright = read_image(folder / "a.jpg", {.apply_orientation = true});
  EXPECT_EQ(stored.width(), 40);
  EXPECT_EQ(upright.width(), 30);
  EXPECT_TRUE(same(upright, oriented(stored, 6)));
}

TEST(Exif, ImpossibleValuesAreLeftOut) {
  test::ExifBuilder exif;
  exif.u16(false, 0x0112, 9);
  exif.ascii(true, 0x9003, "0000:00:00 00:00:00");
  exif.rational(true, 0x920a, 5, 0);
  exif.u16(true, 0xa405, 0);
  const std::string jpeg = test::jpeg_with_exif(encode_jpeg(pattern(8, 8, 3)), exif.tiff());
  const ImageInfo info = decode_image_info(bytes_of(jpeg), "a.jpg");
  EXPECT_EQ(info.orientation, 1);
  EXPECT_EQ(info.time, "");
  EXPECT_FALSE(info.focal_length_mm || info.focal_length_35mm_mm);
}

TEST(Exif, EveryDamagedByteAndEveryCutIsHarmless) {
  test::ExifBuilder exif;
  exif.ascii(false, 0x010f, "A maker of cameras");
  exif.ascii(true, 0x9003, "2019:07:03 14:05:59");
  exif.rational(true, 0x920a, 505, 10);
  const std::string plain = encode_jpeg(pattern(8, 8, 1)), tiff = exif.tiff();
  for (std::size_t i = 0; i < tiff.size(); ++i) {
    for (const int value : {0, 1, 0x7f, 0x80, 0xff}) {
      std::string damaged = tiff;
      damaged[i] = char(value);
      EXPECT_EQ(decode_image_info(bytes_of(test::jpeg_with_exif(plain, damaged)), "x").width, 8);
    }
    EXPECT_EQ(decode_image_info(bytes_of(test::jpeg_with_exif(plain, tiff.substr(0, i))), "x").width, 8);
  }
}

TEST(Oriented, EightOrientationsAreEightMaps) {
  // EXIF 2.32, table 6, by the place where the stored first row and column are seen.
  const Image image = noise(5, 3, 3, PixelType::u16, 1);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    SCOPED_TRACE(orientation);
    const Image out = oriented(image, orientation);
    const int w = image.width(), h = image.height();
    ASSERT_EQ(out.width(), orientation >= 5 ? h : w);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        int u = 0, v = 0;
        switch (orientation) {
          case 1:
            u = x, v = y;
            break;  // row 0 = top, column 0 = left
          case 2:
            u = w - 1 - x, v = y;
            break;  // top, right
          case 3:
            u = w - 1 - x, v = h - 1 - y;
            break;  // bottom, right
          case 4:
            u = x, v = h - 1 - y;
            break;  // bottom, left
          case 5:
            u = y, v = x;
            break;  // left, top
          case 6:
            u = h - 1 - y, v = x;
            break;  // right, top
          case 7:
            u = h - 1 - y, v = w - 1 - x;
            break;  // right, bottom
          case 8:
            u = y, v = w - 1 - x;
            break;  // left, bottom
        }
        for (int c = 0; c < 3; ++c)
          ASSERT_EQ(out.row<std::uint16_t>(v)[3 * u + c], image.row<std::uint16_t>(y)[3 * x + c]);
      }
  }
  EXPECT_TRUE(same(oriented(oriented(pattern(100, 70, 3), 6), 8), pattern(100, 70, 3)));
  EXPECT_EQ(expect_error([&] { oriented(image, 0); }).code(), ErrorCode::invalid_argument);
}

TEST(Converted, ScalesByFullRangeAndComesBack) {
  Image all(256, 1, 1);
  for (int i = 0; i < 256; ++i) all.row<std::uint8_t>(0)[i] = std::uint8_t(i);
  const Image wide = converted(all, PixelType::u16, 1), real = converted(all, PixelType::f32, 1);
  EXPECT_EQ(wide.row<std::uint16_t>(0)[255], 65535);
  EXPECT_EQ(real.row<float>(0)[255], 1.0f);
  EXPECT_TRUE(same(converted(wide, PixelType::u8, 1), all));
  EXPECT_TRUE(same(converted(real, PixelType::u8, 1), all));

  Image sixteen(65536 / 2, 2, 1, PixelType::u16);
  for (int i = 0; i < 65536; ++i) sixteen.row<std::uint16_t>(i / 32768)[i % 32768] = std::uint16_t(i);
  const Image eight = converted(sixteen, PixelType::u8, 1);
  for (int i = 0; i < 65536; ++i)
    ASSERT_EQ(eight.row<std::uint8_t>(i / 32768)[i % 32768], int(std::lround(i / 257.0))) << i;
  EXPECT_TRUE(same(converted(converted(sixteen, PixelType::f32, 1), PixelType::u16, 1), sixteen));

  Image wild(4, 1, 1, PixelType::f32);
  const float values[] = {NAN, -1.0f, 2.0f, INFINITY};
  std::memcpy(wild.data(), values, sizeof values);
  const Image tame = converted(wild, PixelType::u8, 1);
  EXPECT_EQ(tame.row<std::uint8_t>(0)[0], 0);
  EXPECT_EQ(tame.row<std::uint8_t>(0)[1], 0);
  EXPECT_EQ(tame.row<std::uint8_t>(0)[2], 255);
  EXPECT_EQ(tame.row<std::uint8_t>(0)[3], 255);
}

TEST(Converted, GreyIsRec709AndAlphaIsOpaque) {
  Image colours(4, 1, 3);
  const std::uint8_t rgb[] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 200, 200, 200};
  std::memcpy(colours.data(), rgb, sizeof rgb);
  const Image grey = converted(colours, PixelType::u8, 1);
  EXPECT_EQ(grey.row<std::uint8_t>(0)[0], 54);   // 0.2126 * 255
  EXPECT_EQ(grey.row<std::uint8_t>(0)[1], 182);  // 0.7152 * 255
  EXPECT_EQ(grey.row<std::uint8_t>(0)[2], 18);   // 0.0722 * 255
  EXPECT_EQ(grey.row<std::uint8_t>(0)[3], 200);
  const Image rgba = converted(colours, PixelType::u16, 4);
  EXPECT_EQ(rgba.row<std::uint16_t>(0)[3], 65535);
  EXPECT_EQ(rgba.row<std::uint16_t>(0)[0], 65535);
  EXPECT_TRUE(same(converted(rgba, PixelType::u8, 3), colours));
}

TEST(Srgb, BothDirectionsMatchTheStandard) {
  EXPECT_NEAR(linear_from_srgb(0.5f), 0.21404114f, 1e-6);
  EXPECT_NEAR(linear_from_srgb(0.04f), 0.04f / 12.92f, 1e-8);
  for (int i = 0; i <= 1000; ++i) EXPECT_NEAR(srgb_from_linear(linear_from_srgb(i / 1000.0f)), i / 1000.0f, 2e-6);
}

TEST(Write, RefusesWhatTheFormatsCannotHold) {
  EXPECT_EQ(expect_error([] { encode_png(pattern(4, 4, 3, PixelType::f32)); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([] { encode_jpeg(pattern(4, 4, 4)); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([] { encode_jpeg(pattern(4, 4, 3), 0); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(expect_error([] { encode_png(pattern(4, 4, 3), {.compression = 10}); }).code(),
            ErrorCode::invalid_argument);
  const Error error = expect_error([] { write_png("/nowhere/at/all.png", pattern(4, 4, 3)); });
  EXPECT_TRUE(error.code() == ErrorCode::io || error.code() == ErrorCode::not_found);
  EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere/at"));
}

TEST(Image, ReducedPicturesAreTheFullOnesAveraged) {
  Image image(101, 67, 3);
  for (int y = 0; y < 67; ++y)
    for (int x = 0; x < 101; ++x)
      for (int c = 0; c < 3; ++c) image.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(x + y / (c + 1));
  const std::string png = encode_png(image), jpeg = encode_jpeg(image, 98);
  for (const int n : {1, 2, 4, 8})
    for (const std::string* file : {&png, &jpeg}) {
      const Image small = decode_image(std::as_bytes(std::span(*file)), "picture", {.channels = 3, .reduction = n});
      ASSERT_EQ(small.width(), (101 + n - 1) / n);
      ASSERT_EQ(small.height(), (67 + n - 1) / n);
      for (int y = 0; y + 1 < small.height(); ++y)
        for (int x = 0; x + 1 < small.width(); ++x)
          EXPECT_NEAR(small.row<std::uint8_t>(y)[3 * x], n * (x + y) + (n - 1), 4.0);
    }
  EXPECT_EQ(expect_error([&] { decode_image(std::as_bytes(std::span(png)), "picture", {.reduction = 3}); }).code(),
            ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull
