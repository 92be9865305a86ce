// Masks as PNG: what is written must be read by others, and every damage must be noticed.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>

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

void expect_read_by_all(const Image& mask) {
  const std::string png = encode_mask(mask);
  const cv::Mat peer = cv::imdecode(std::vector<char>(png.begin(), png.end()), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(peer.type(), CV_8UC1);
  ASSERT_EQ(peer.cols, mask.width());
  ASSERT_EQ(peer.rows, mask.height());
  // One channel asked takes the short way, three the way of every PNG.
  const Image own = decode_image(bytes_of(png), "m.png", {.channels = 1});
  const Image plain = decode_image(bytes_of(png), "m.png", {.channels = 3});
  ASSERT_EQ(own.channels(), 1);
  ASSERT_EQ(own.width(), mask.width());
  ASSERT_EQ(own.height(), mask.height());
  ASSERT_EQ(plain.channels(), 3);
  for (int y = 0; y < mask.height(); ++y) {
    const std::uint8_t* row = mask.row<std::uint8_t>(y);
    ASSERT_EQ(std::memcmp(row, peer.ptr(y), std::size_t(mask.width())), 0) << y;
    ASSERT_EQ(std::memcmp(row, own.row<std::uint8_t>(y), std::size_t(mask.width())), 0) << y;
    for (int x = 0; x < mask.width(); ++x) ASSERT_EQ(row[x], plain.row<std::uint8_t>(y)[3 * x]) << x << ", " << y;
  }
}

TEST(MaskPng, RunsOfEveryLength) {
  // Row y holds a run of y pixels; the lengths of deflate's matches end at 258, two of them at 516.
  Image mask(1100, 1100, 1);
  for (int y = 0; y < 1100; ++y)
    std::memset(mask.row<std::uint8_t>(y) + 1, y % 3 == 0 ? 255 : 1 + y % 250, std::size_t(y % 1099));
  expect_read_by_all(mask);
}

TEST(MaskPng, EveryLiteralAndNoise) {
  Image steps(256, 3, 1);
  for (int x = 0; x < 256; ++x) steps.row<std::uint8_t>(1)[x] = std::uint8_t(x);
  expect_read_by_all(steps);
  std::mt19937 random(7);
  Image noise(301, 77, 1), sparse(1003, 91, 1);
  for (std::size_t i = 0; i < noise.bytes(); ++i) noise.data()[i] = std::byte(random());
  expect_read_by_all(noise);
  for (std::size_t i = 0; i < sparse.bytes(); ++i) sparse.data()[i] = std::byte(random() % 40 == 0 ? random() : 0);
  expect_read_by_all(sparse);
}

TEST(MaskPng, OnePixelEmptyAndFull) {
  for (const int value : {0, 127, 255})
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 300}, {300, 1}, {3072, 200}}) {
      Image mask(w, h, 1);
      std::memset(mask.data(), value, mask.bytes());
      expect_read_by_all(mask);
    }
}

TEST(MaskPng, IsSmall) {
  Image mask(3072, 2048, 1);  // a disc
  for (int y = 0; y < 2048; ++y)
    for (int x = 0; x < 3072; ++x) mask.row<std::uint8_t>(y)[x] = std::hypot(x - 1500, y - 1000) < 700 ? 255 : 0;
  EXPECT_LT(encode_mask(mask).size(), 60'000u);
}

TEST(MaskPng, EveryFlippedByteAndEveryLossIsNoticed) {
  Image mask(40, 12, 1);
  for (int y = 3; y < 9; ++y) std::memset(mask.row<std::uint8_t>(y) + 11, 255, 17);
  const std::string whole = encode_mask(mask);
  for (std::size_t i = 8; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = char(damaged[i] ^ 0x10);
    EXPECT_EQ(expect_error([&] { decode_image(bytes_of(damaged), "m.png", {.channels = 1}); }).code(),
              ErrorCode::bad_input)
        << i;
  }
  for (std::size_t length = 8; length < whole.size(); ++length)
    EXPECT_EQ(expect_error([&] { decode_image(bytes_of(whole.substr(0, length)), "m.png", {.channels = 1}); }).code(),
              ErrorCode::bad_input)
        << length;
}

TEST(MaskPng, OnlyMasksAreTaken) {
  for (const Image& image : {Image(), Image(4, 4, 3), Image(4, 4, 1, PixelType::u16)})
    EXPECT_EQ(expect_error([&] { encode_mask(image); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull
