#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/exif.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "support.h"

namespace lumihull::rig {
namespace {

ExifTags tags() {
  ExifTags t;
  t.time = "2007:08:21 09:10:11";
  t.width = 32, t.height = 20;
  return t;
}

TEST(Exif, IsReadBack) {
  const Image image(32, 20, 3);
  const std::string plain = encode_jpeg(image), jpeg = with_exif(plain, tags());
  const auto bytes = std::as_bytes(std::span(jpeg));
  const ImageInfo info = decode_image_info(bytes, "test");
  EXPECT_EQ(info.width, 32);
  EXPECT_EQ(info.height, 20);
  EXPECT_EQ(info.orientation, 1);
  ASSERT_TRUE(info.focal_length_mm);
  EXPECT_NEAR(*info.focal_length_mm, 18, 1e-9);
  ASSERT_TRUE(info.focal_length_35mm_mm);
  EXPECT_NEAR(*info.focal_length_35mm_mm, 29, 1e-9);
  EXPECT_EQ(info.time, "2007-08-21T09:10:11");
  EXPECT_EQ(info.make, "Lumihull");
  EXPECT_EQ(info.model, "Virtual Rig");
  EXPECT_EQ(info.lens, "18 mm");
  // The pixels are untouched.
  const Image a = decode_image(std::as_bytes(std::span(plain)), "a"), b = decode_image(bytes, "b");
  ASSERT_EQ(a.bytes(), b.bytes());
  EXPECT_TRUE(std::equal(a.data(), a.data() + a.bytes(), b.data()));
}

/// The side of the picture that is up, turned as the tag says, is the top.
TEST(Exif, OrientationTurnsWhatIsUpToTheTop) {
  const std::pair<Eigen::Vector3d, int> held[] = {{{.1, -.9, .3}, 1}, {{-.9, .1, .2}, 6},  {{.8, .3, -.5}, 8},
                                                  {{-.2, .9, 0}, 3},  {{.2, -.1, .97}, 1}, {{0, 0, -1}, 1}};
  for (const auto& [up, expected] : held) {
    ASSERT_EQ(exif_orientation(up), expected) << up.transpose();
    if (std::fabs(up.z()) > .9) continue;  // it looks up or down
    Image picture(32, 16, 3);
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 32; ++x)
        for (int c = 0; c < 3; ++c)
          picture.row<std::uint8_t>(y)[3 * x + c] = up.x() * (x - 15.5) + up.y() * (y - 7.5) > 0 ? 255 : 0;
    ExifTags t = tags();
    t.orientation = expected;
    const std::string jpeg = with_exif(encode_jpeg(picture), t);
    const auto bytes = std::as_bytes(std::span(jpeg));
    EXPECT_EQ(decode_image_info(bytes, "test").orientation, expected);
    const Image raw = decode_image(bytes, "raw"), upright = decode_image(bytes, "upright", {.apply_orientation = true});
    EXPECT_EQ(raw.width(), 32) << "sensor's rows and columns unless asked";
    ASSERT_EQ(upright.width(), expected >= 5 ? 16 : 32);
    const int middle = upright.width() / 2;
    EXPECT_GT(upright.row<std::uint8_t>(1)[3 * middle], 200) << expected;
    EXPECT_LT(upright.row<std::uint8_t>(upright.height() - 2)[3 * middle], 50) << expected;
  }
}

TEST(Exif, AnIndependentReaderFindsNoFault) {
  if (std::system("command -v exiftool > /dev/null 2>&1") != 0) GTEST_SKIP() << "needs exiftool";
  const test::TemporaryFolder folder;
  write_file(folder / "a.jpg", with_exif(encode_jpeg(Image(32, 20, 3)), tags()));
  const std::string command =
      "exiftool -n -s -s -s -warning -error -FocalLength -DateTimeOriginal -Model -FocalPlaneXResolution '" +
      (folder / "a.jpg").string() + "'";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_TRUE(pipe);
  std::string out;
  for (int c; (c = std::fgetc(pipe)) != EOF;) out += char(c);
  pclose(pipe);
  EXPECT_EQ(out, "18\n2007:08:21 09:10:11\nVirtual Rig\n14.097\n");
}

TEST(Exif, OnlyJpegsCarryIt) {
  EXPECT_EQ(test::expect_error([] { with_exif("\x89PNG", tags()); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([] { with_exif("", tags()); }).code(), ErrorCode::invalid_argument);
  ExifTags long_text = tags();
  long_text.model = std::string(70000, 'x');
  EXPECT_EQ(test::expect_error([&] { with_exif(encode_jpeg(Image(8, 8, 3)), long_text); }).code(),
            ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::rig
