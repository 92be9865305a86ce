// Formats that OpenImageIO reads in a module of its own. The files are written by OpenCV, or byte by byte.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

using test::expect_error;
using test::pattern;

/// Writes a picture by OpenCV (BGR order).
void write_by_opencv(const std::filesystem::path& file, const Image& image) {
  const int depth = image.type() == PixelType::u8 ? CV_8U : image.type() == PixelType::u16 ? CV_16U : CV_32F;
  cv::Mat mat(image.height(), image.width(), CV_MAKETYPE(depth, image.channels()));
  const std::size_t size = size_of(image.type()), n = std::size_t(image.channels());
  for (int y = 0; y < image.height(); ++y)
    for (std::size_t i = 0; i < std::size_t(image.width()) * n; ++i) {
      const std::size_t channel = i % n, swapped = n >= 3 && channel < 3 ? 2 - channel : channel;
      std::memcpy(mat.ptr(y) + (i - channel + swapped) * size, image.data() + image.row_bytes() * y + i * size, size);
    }
  // TIFF uncompressed: OpenCV would store floats as 24-bit LogLuv.
  const bool tiff = file.extension() == ".tif";
  ASSERT_TRUE(
      cv::imwrite(file.string(), mat, tiff ? std::vector<int>{cv::IMWRITE_TIFF_COMPRESSION, 1} : std::vector<int>()));
}

#define NEED_MODULE()                                                                                  \
  try {                                                                                                \
    const test::TemporaryFolder probe_folder;                                                          \
    write_by_opencv(probe_folder / "probe.bmp", pattern(2, 2, 3));                                     \
    read_image_info(probe_folder / "probe.bmp");                                                       \
  } catch (const Error& e) {                                                                           \
    if (e.code() == ErrorCode::unsupported) GTEST_SKIP() << "built without OpenImageIO: " << e.what(); \
    throw;                                                                                             \
  }

TEST(ImageModule, LosslessFormatsAreExact) {
  NEED_MODULE();
  const test::TemporaryFolder folder;
  for (const auto& [name, image] : {std::pair{"a.tif", pattern(31, 17, 3)},
                                    {"b.tif", pattern(31, 17, 3, PixelType::u16)},
                                    {"c.tif", pattern(31, 17, 1)},
                                    {"d.bmp", pattern(31, 17, 3)},
                                    {"e.tif", pattern(31, 17, 3, PixelType::f32)}}) {
    SCOPED_TRACE(name);
    write_by_opencv(folder / name, image);
    const Image back = read_image(folder / name);
    ASSERT_EQ(std::tuple(back.width(), back.height(), back.channels(), back.type()),
              std::tuple(image.width(), image.height(), image.channels(), image.type()));
    EXPECT_EQ(std::memcmp(back.data(), image.data(), image.bytes()), 0);
    const ImageInfo info = read_image_info(folder / name);
    EXPECT_EQ(std::tuple(info.width, info.height, info.channels, info.type),
              std::tuple(image.width(), image.height(), image.channels(), image.type()));
    EXPECT_EQ(read_image(folder / name, {.channels = 4}).channels(), 4);
  }
}

TEST(ImageModule, WebPIsRead) {
  NEED_MODULE();
  const test::TemporaryFolder folder;
  const Image image = pattern(64, 48, 3);
  write_by_opencv(folder / "a.webp", image);
  const Image back = read_image(folder / "a.webp", {.channels = 3});
  ASSERT_EQ(back.width(), 64);
  double sum = 0;
  for (std::size_t i = 0; i < image.bytes(); ++i) sum += std::abs(int(back.data()[i]) - int(image.data()[i]));
  EXPECT_LT(sum / double(image.bytes()), 4);
}

TEST(ImageModule, LinearOpenExrIsEncodedToSrgb) {
  NEED_MODULE();
  setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1);
  const test::TemporaryFolder folder;
  cv::Mat mat(2, 3, CV_32FC3, cv::Scalar(2.0, 0.5, 0.21404114));  // blue, green, red
  bool written = false;
  try {
    written = cv::imwrite((folder / "a.exr").string(), mat);
  } catch (const cv::Exception&) {
  }
  if (!written) GTEST_SKIP() << "this OpenCV writes no OpenEXR";
  const Image image = read_image(folder / "a.exr");
  ASSERT_EQ(image.type(), PixelType::f32);
  ASSERT_EQ(image.channels(), 3);
  EXPECT_NEAR(image.row<float>(1)[0], 0.5, 1e-4);
  EXPECT_NEAR(image.row<float>(1)[1], 0.7353569, 1e-4);
  EXPECT_NEAR(image.row<float>(1)[2], 1.3532560, 1e-4);  // brighter than white stays so
}

/// A minimal TIFF, little-endian, one strip: entries are (tag, type, count, value).
std::string tiff(std::vector<std::array<std::uint32_t, 4>> entries, const std::string& pixels) {
  const auto n = test::ExifBuilder::number;
  const std::size_t data = 8 + 2 + 12 * (entries.size() + 1) + 4;
  entries.push_back({273, 4, 1, std::uint32_t(data)});  // StripOffsets
  std::sort(entries.begin(), entries.end());
  std::string out = "II" + n(42, 2) + n(8, 4) + n(std::uint32_t(entries.size()), 2);
  for (const auto& e : entries) out += n(e[0], 2) + n(e[1], 2) + n(e[2], 4) + n(e[3], 4);
  return out + n(0, 4) + pixels;
}

TEST(ImageModule, AlphaIsNotMultipliedAndOrientationIsGiven) {
  NEED_MODULE();
  const test::TemporaryFolder folder;
  // 2 x 1 RGBA, unassociated alpha (ExtraSamples 2), orientation 3, BitsPerSample 8: its default of 1 x 4 is overridden
  // by one value for all, which libtiff accepts.
  const std::string pixels("\xc8\x64\x32\x80\x0a\x14\x1e\xff", 8);
  const auto make = [&](std::uint32_t extra) {
    return tiff({{256, 3, 1, 2},
                 {257, 3, 1, 1},
                 {258, 3, 1, 8},
                 {259, 3, 1, 1},
                 {262, 3, 1, 2},
                 {274, 3, 1, 3},
                 {277, 3, 1, 4},
                 {278, 3, 1, 1},
                 {279, 4, 1, 8},
                 {284, 3, 1, 1},
                 {338, 3, 1, extra}},
                pixels);
  };
  write_file(folder / "u.tif", make(2));
  const Image straight = read_image(folder / "u.tif");
  ASSERT_EQ(straight.channels(), 4);
  EXPECT_EQ(std::memcmp(straight.data(), pixels.data(), 8), 0);
  EXPECT_EQ(read_image_info(folder / "u.tif").orientation, 3);
  EXPECT_EQ(read_image(folder / "u.tif", {.apply_orientation = true}).row<std::uint8_t>(0)[0], 0x0a);
  // Associated alpha is divided out: 0x32 / (0x80 / 255) = 99.6; what exceeds white is white.
  write_file(folder / "a.tif", make(1));
  const Image associated = read_image(folder / "a.tif");
  EXPECT_EQ(associated.row<std::uint8_t>(0)[2], 100);
  EXPECT_EQ(associated.row<std::uint8_t>(0)[0], 255);
  EXPECT_EQ(associated.row<std::uint8_t>(0)[4], 0x0a);
}

TEST(ImageModule, DamagedAndUnknownFilesAreErrors) {
  NEED_MODULE();
  const test::TemporaryFolder folder;
  write_by_opencv(folder / "a.tif", pattern(200, 150, 3));
  const std::string whole = read_file(folder / "a.tif");
  for (int i = 1; i < 10; ++i) {
    SCOPED_TRACE(i);
    write_file(folder / "cut.tif", whole.substr(0, whole.size() * std::size_t(i) / 10));
    const Error error = expect_error([&] { read_image(folder / "cut.tif"); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_EQ(error.subject(), (folder / "cut.tif").string());
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  write_file(folder / "notes.txt", "These are words.");
  EXPECT_EQ(expect_error([&] { read_image(folder / "notes.txt"); }).code(), ErrorCode::bad_input);
  // A header that asks for more than the limits.
  const std::string huge = tiff({{256, 4, 1, 70000},
                                 {257, 4, 1, 70000},
                                 {258, 3, 1, 8},
                                 {259, 3, 1, 1},
                                 {262, 3, 1, 1},
                                 {277, 3, 1, 1},
                                 {278, 4, 1, 70000},
                                 {279, 4, 1, 4}},
                                "abcd");
  write_file(folder / "huge.tif", huge);
  EXPECT_EQ(expect_error([&] { read_image(folder / "huge.tif"); }).code(), ErrorCode::bad_input);
}

/// A camera RAW file in small: DNG with a Bayer pattern RGGB of one flat colour, orientation as given.
std::string dng(std::uint32_t orientation, int width, int height) {
  const auto n = test::ExifBuilder::number;
  std::string pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool bright = x < width / 2 && y < height / 2;  // the first quarter is brighter
      pixels += n(bright ? 40000 : 8000, 2);
    }
  // XYZ to camera: identity, as signed rationals, stored behind the pixels.
  std::string matrix;
  for (int i = 0; i < 9; ++i) matrix += n(i % 4 == 0 ? 1 : 0, 4) + n(1, 4);
  std::vector<std::array<std::uint32_t, 4>> entries = {{254, 4, 1, 0},
                                                       {256, 4, 1, std::uint32_t(width)},
                                                       {257, 4, 1, std::uint32_t(height)},
                                                       {258, 3, 1, 16},
                                                       {259, 3, 1, 1},
                                                       {262, 3, 1, 32803},
                                                       {274, 3, 1, orientation},
                                                       {277, 3, 1, 1},
                                                       {278, 4, 1, std::uint32_t(height)},
                                                       {279, 4, 1, std::uint32_t(pixels.size())},
                                                       {284, 3, 1, 1},
                                                       {33421, 3, 2, 2 | 2 << 16},
                                                       {33422, 1, 4, 0x02010100},
                                                       {50706, 1, 4, 0x00000401},
                                                       {50717, 4, 1, 65535},
                                                       {50721, 10, 9, 0},
                                                       {50778, 3, 1, 21}};
  const std::size_t data = 8 + 2 + 12 * (entries.size() + 1) + 4;
  for (auto& e : entries)
    if (e[0] == 50721) e[3] = std::uint32_t(data + pixels.size());
  return tiff(entries, pixels + matrix);
}

TEST(ImageModule, CameraRawKeepsTheSensorsRowsAndSaysItsOrientation) {
  NEED_MODULE();
  const test::TemporaryFolder folder;
  for (const int orientation : {1, 2, 3, 4, 5, 6, 7, 8}) {
    SCOPED_TRACE(orientation);
    const auto file = folder / ("raw" + std::to_string(orientation) + ".dng");
    write_file(file, dng(std::uint32_t(orientation), 160, 96));
    const Image image = read_image(file);
    ASSERT_EQ(image.channels(), 3);
    EXPECT_EQ(image.type(), PixelType::u16);
    const auto green = [&](int x, int y) { return image.row<std::uint16_t>(y)[3 * x + 1]; };
    ASSERT_EQ(image.width(), 160);
    EXPECT_GT(green(40, 24), 1.5 * green(120, 24));
    EXPECT_GT(green(40, 24), 1.5 * green(40, 72));
    EXPECT_GT(green(40, 24), 1.5 * green(120, 72));
    EXPECT_EQ(read_image_info(file).orientation, orientation);
  }
}

}  // namespace
}  // namespace lumihull
