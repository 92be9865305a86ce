// Picture files that are not what they should be: each is an Error that names the file.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

using test::bytes_of;
using test::expect_error;
using test::pattern;

std::string with_u32(std::string bytes, std::size_t at, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes[at + std::size_t(i)] = char(value >> (24 - 8 * i) & 255);
  return bytes;
}

class Truncated : public testing::TestWithParam<const char*> {};

TEST_P(Truncated, AtEveryTenthAndOneByteShortIsAnError) {
  const std::string name = std::string("photo.") + GetParam();
  const Image image = pattern(200, 150, 3);
  const std::string whole = name.ends_with("png") ? encode_png(image) : encode_jpeg(image);
  std::vector<std::size_t> lengths{whole.size() - 1, whole.size() - 2, 9, 4, 3};
  for (std::size_t i = 1; i < 10; ++i) lengths.push_back(whole.size() * i / 10);
  const test::TemporaryFolder folder;
  for (const std::size_t length : lengths) {
    SCOPED_TRACE(length);
    write_file(folder / name, whole.substr(0, length));
    const Error error = expect_error([&] { read_image(folder / name); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_EQ(error.subject(), (folder / name).string());
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Truncated, testing::Values("jpg", "png"));

TEST(Fault, EmptyFileFolderMissingFileAndNotAPicture) {
  const test::TemporaryFolder folder;
  write_file(folder / "empty.jpg", "");
  write_file(folder / "text.jpg", "These are words.");
  write_file(folder / "text.png", "These are words.");
  std::filesystem::create_directory(folder / "folder.jpg");
  for (const auto& [name, code] : {std::pair{"empty.jpg", ErrorCode::bad_input},
                                   {"text.jpg", ErrorCode::bad_input},
                                   {"text.png", ErrorCode::bad_input},
                                   {"folder.jpg", ErrorCode::bad_input},
                                   {"missing.jpg", ErrorCode::not_found},
                                   {"empty.jpg/x.jpg", ErrorCode::not_found}}) {
    SCOPED_TRACE(name);
    for (const bool info : {false, true}) {
      const Error error = expect_error([&, name = name] {
        if (info)
          read_image_info(folder / name);
        else
          read_image(folder / name);
      });
      EXPECT_EQ(error.code(), code);
      EXPECT_EQ(error.subject(), (folder / name).string());
    }
  }
}

TEST(Fault, APipeIsRefusedAndNotWaitedFor) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe.jpg").c_str(), 0600), 0);
  EXPECT_EQ(expect_error([&] { read_image(folder / "pipe.jpg"); }).code(), ErrorCode::bad_input);
  EXPECT_EQ(expect_error([&] { read_image_info(folder / "pipe.jpg"); }).code(), ErrorCode::bad_input);
}

TEST(Fault, TooLargeAFileIsNotRead) {
  const test::TemporaryFolder folder;
  write_jpeg(folder / "a.jpg", pattern(64, 64, 3));
  EXPECT_EQ(expect_error([&] { read_image(folder / "a.jpg", {.max_file_bytes = 100}); }).code(), ErrorCode::bad_input);
}

TEST(Fault, EachFlippedByteOfAPngIsNoticed) {
  const std::string whole = encode_png(pattern(16, 12, 3));
  for (std::size_t i = 8; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = char(damaged[i] ^ 0x10);
    EXPECT_EQ(expect_error([&] { decode_image(bytes_of(damaged), "a.png"); }).code(), ErrorCode::bad_input) << i;
  }
}

TEST(Fault, SizesBeyondTheLimitsAreRefusedBeforeMemoryIsTaken) {
  // PNG: width and height stand at bytes 16 and 20, their CRC at 29.
  const std::string png = encode_png(pattern(8, 8, 3));
  for (const auto& [w, h] :
       {std::pair{65501u, 8u}, {8u, 65501u}, {0u, 8u}, {60000u, 60000u}, {0x7fffffffu, 0x7fffffffu}}) {
    SCOPED_TRACE(w);
    const std::string hostile = with_u32(with_u32(png, 16, w), 20, h);
    EXPECT_EQ(expect_error([&] { decode_image(bytes_of(hostile), "big.png"); }).code(), ErrorCode::bad_input);
    EXPECT_EQ(expect_error([&] { decode_image_info(bytes_of(hostile), "big.png"); }).code(), ErrorCode::bad_input);
  }
  // JPEG: the frame header holds height and width behind FF C0, length and precision.
  const std::string jpeg = encode_jpeg(pattern(8, 8, 3));
  const std::size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  for (const std::uint32_t size : {0xffdd'0008u /* 65501 high */, 0x0008'ffddu, 0xea60'ea60u, 0u, 0x4e20'4e20u}) {
    const std::string hostile = with_u32(jpeg, frame + 5, size);
    EXPECT_EQ(expect_error([&] { decode_image(bytes_of(hostile), "big.jpg"); }).code(), ErrorCode::bad_input) << size;
  }
  const Error error =
      expect_error([&] { decode_image_info(bytes_of(with_u32(jpeg, frame + 5, 0x0008'ffddu)), "big.jpg"); });
  EXPECT_THAT(error.message(), testing::HasSubstr("65501"));
}

TEST(Fault, RandomDamageNeverCrashesAndNeverChangesTheSize) {
  std::mt19937 random(7);
  for (const std::string& whole : {encode_jpeg(pattern(64, 48, 3)), encode_png(pattern(64, 48, 3))})
    for (int i = 0; i < 500; ++i) {
      std::string damaged = whole;
      for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = char(random());
      try {
        const Image image = decode_image(bytes_of(damaged), "damaged");
        EXPECT_GE(image.width(), 1);
      } catch (const Error& e) {
        EXPECT_EQ(e.subject(), "damaged");
        EXPECT_NE(e.code(), ErrorCode::internal);
      }
    }
}

TEST(Fault, AJpegWithDamagedScanIsAnErrorAndNotAGreyPicture) {
  std::string jpeg = encode_jpeg(pattern(200, 150, 3));
  // An end marker in the middle of the scan: libjpeg alone would warn and fill the rest with grey.
  jpeg[jpeg.size() / 2] = '\xff';
  jpeg[jpeg.size() / 2 + 1] = '\xd9';
  EXPECT_EQ(expect_error([&] { decode_image(bytes_of(jpeg), "a.jpg"); }).code(), ErrorCode::bad_input);
}

TEST(Fault, StrayBytesThatCamerasLeaveBeforeTheEndOfAJpegAreHarmless) {
  const std::string jpeg = encode_jpeg(pattern(200, 150, 3));
  const Image clean = decode_image(bytes_of(jpeg), "a.jpg");
  const auto with = [&](const std::string& stray) { return jpeg.substr(0, jpeg.size() - 2) + stray + "\xff\xd9"; };
  for (const std::string& stray :
       {std::string("\x7f"), std::string("\x12\x34"), std::string(1, '\0'), std::string(3000, '\0'),
        std::string(40, '\xff'), std::string("\xff\0\xff\0\0\0\0\0\0\0\0\0\0", 13)}) {
    SCOPED_TRACE(stray.size());
    const Image image = decode_image(bytes_of(with(stray)), "a.jpg");
    ASSERT_EQ(image.bytes(), clean.bytes());
    EXPECT_EQ(std::memcmp(image.data(), clean.data(), clean.bytes()), 0);
  }
  // More than that is the rest of a scan whose damage made it end early.
  const std::string rest = jpeg.substr(jpeg.size() - 42, 40);
  EXPECT_EQ(expect_error([&] { decode_image(bytes_of(with(rest)), "a.jpg"); }).code(), ErrorCode::bad_input);
  // No padding makes up for rows that are missing.
  std::string cut = jpeg.substr(0, jpeg.size() / 2) + std::string(jpeg.size() / 2, '\0') + "\xff\xd9";
  EXPECT_EQ(expect_error([&] { decode_image(bytes_of(cut), "a.jpg"); }).code(), ErrorCode::bad_input);
}

TEST(Fault, CmykIsUnsupportedAndSaysWhatToDo) {
  // A frame of four components: the third-from-first byte of the frame header's component list is enough for info;
  // decoding meets it when the header is read.
  std::string jpeg = encode_jpeg(pattern(8, 8, 3));
  const std::size_t frame = jpeg.find("\xff\xc0"), scan = jpeg.find("\xff\xda");
  ASSERT_NE(scan, std::string::npos);
  jpeg.insert(frame + 4 + 15, std::string("\x04\x11\x00", 3));  // a fourth component
  jpeg[frame + 3] = char(jpeg[frame + 3] + 3);
  jpeg[frame + 9] = 4;
  const std::size_t new_scan = scan + 3;
  jpeg.insert(new_scan + 5 + 6, std::string("\x04\x00", 2));
  jpeg[new_scan + 3] = char(jpeg[new_scan + 3] + 2);
  jpeg[new_scan + 4] = 4;
  const Error error = expect_error([&] { decode_image(bytes_of(jpeg), "cmyk.jpg"); });
  EXPECT_EQ(error.code(), ErrorCode::unsupported);
  EXPECT_THAT(error.message(), testing::HasSubstr("CMYK"));
}

}  // namespace
}  // namespace lumihull
