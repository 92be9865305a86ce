#include <fcntl.h>
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <sys/file.h>
#include <unistd.h>

#include <cmath>

#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::expect_error;

Capture import_list(const test::TemporaryFolder& folder, const std::vector<fs::path>& files) {
  Job job;
  ImportOptions options;
  options.output = folder / "capture";
  return import_photos(files, options, job);
}

TEST(ImportPhotos, CamerasAreGroupedAndFocalLengthsComeFromExif) {
  const test::TemporaryFolder folder;
  test::ExifBuilder exif;
  exif.ascii(false, 0x010f, "Lumi");
  exif.u16(false, 0x0112, 8);
  exif.ascii(true, 0x9003, "2019:07:03 14:05:59");
  exif.u16(true, 0xa405, 50);
  const std::string plain = encode_jpeg(test::pattern(90, 60, 3));
  write_file(folder / "a.jpg", test::jpeg_with_exif(plain, exif.tiff()));
  write_file(folder / "b.jpg", test::jpeg_with_exif(plain, exif.tiff()));
  write_file(folder / "c.jpg", plain);
  write_png(folder / "a.png", test::pattern(60, 90, 3));
  const Capture capture = import_list(folder, {folder / "a.jpg", folder / "b.jpg", folder / "c.jpg", folder / "a.png"});
  ASSERT_EQ(capture.shots.size(), 4u);
  ASSERT_EQ(capture.cameras.size(), 3u);
  EXPECT_EQ(capture.shots[0].camera, capture.shots[1].camera);
  EXPECT_EQ(capture.shots[0].orientation, 8);
  EXPECT_EQ(capture.shots[0].time, "2019-07-03T14:05:59");
  EXPECT_FALSE(capture.positioned(0));
  // 36 mm x 24 mm has the picture's shape, so 50 mm is 50 / 36 of its width.
  EXPECT_NEAR(capture.cameras[0].f, 50.0 / 36 * 90, 1e-9);
  EXPECT_NEAR(capture.cameras[1].f, 1.2 * 90, 1e-9);
  EXPECT_EQ(capture.cameras[2].width, 60);
  EXPECT_EQ(capture.shots[0].name, "a");
  EXPECT_NE(capture.shots[3].name, "a");
  EXPECT_EQ(read_file(capture.photo_path(capture.shots[0])), read_file(folder / "a.jpg"));
  ASSERT_EQ(capture.notes.size(), 3u);
  EXPECT_THAT(capture.notes[1], testing::HasSubstr("guess"));
}

TEST(ImportPhotos, ManyOfOneNameStayApart) {
  const test::TemporaryFolder folder;
  std::vector<fs::path> files;
  for (int i = 0; i < 5; ++i) {
    const fs::path sub = folder / ("s" + std::to_string(i % 2)) / std::to_string(i / 2) / "x";
    fs::create_directories(sub);
    write_png(sub / "a.png", test::pattern(8, 8, 3));
    files.push_back(sub / "a.png");
  }
  const Capture capture = import_list(folder, files);
  std::set<std::string> names;
  for (const Shot& shot : capture.shots) names.insert(shot.name);
  EXPECT_EQ(names.size(), 5u);
}

TEST(ImportPhotos, NothingAndNonPicturesAreErrors) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(expect_error([&] { import_list(folder, {}); }).code(), ErrorCode::bad_input);
  write_file(folder / "a.jpg", "words");
  EXPECT_EQ(expect_error([&] { import_list(folder, {folder / "a.jpg"}); }).subject(), (folder / "a.jpg").string());
  EXPECT_FALSE(fs::exists(folder / "capture"));
}

TEST(ImportPhotos, NamesOfAnyBytesBecomeNamesThatACaptureHolds) {
  const test::TemporaryFolder folder;
  const std::string picture = encode_png(test::pattern(8, 8, 3));
  std::string accents = "a";
  for (int i = 0; i < 80; ++i) accents += "\xc3\xa9";
  const std::vector<std::string> names{"caf\xe9.png",    "caf\xe8.png",  "line\nbreak.png",
                                       accents + ".png", "no_extension", "x.\xff\xfe"};
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    write_file(folder / name, picture);
    files.push_back(folder / name);
  }
  const Capture capture = import_list(folder, files);
  ASSERT_EQ(capture.shots.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(capture.read_photo(i).width(), 8) << i;
  EXPECT_EQ(capture.shots[0].name, "caf_");
  EXPECT_EQ(capture.shots[2].name, "line_break");
  EXPECT_EQ(capture.shots[3].name, accents.substr(0, 119)) << "cut between characters";
  EXPECT_EQ(capture.shots[4].file, "photos/no_extension");
  Capture again = Capture::open(folder / "capture");
  Job job;
  EXPECT_EQ(import_enclosure(again, files, false, job), int(names.size()));
  EXPECT_EQ(Capture::open(folder / "capture").enclosure.size(), names.size());

  ImportOptions options;
  options.output = folder / "referring";
  options.reference = true;
  const Error error = expect_error([&] { import_photos(std::span(files).first(1), options, job); });
  EXPECT_EQ(error.code(), ErrorCode::unsupported);
  EXPECT_THAT(error.subject(), testing::HasSubstr("caf?"));
}

TEST(ImportPhotos, AKilledImportsLeftoverGoesAndARunningOnesStays) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", test::pattern(8, 8, 3));
  for (const char* name : {".capture.importing-0", ".capture.importing-1"}) {
    fs::create_directories(folder / name / "photos");
    write_file(folder / name / "photos/a.png", "half a photograph");
  }
  const int running = open((folder / ".capture.importing-0").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(running, LOCK_EX), 0);
  import_list(folder, {folder / "a.png"});
  close(running);
  EXPECT_TRUE(fs::exists(folder / ".capture.importing-0/photos/a.png"));
  EXPECT_FALSE(fs::exists(folder / ".capture.importing-1"));
}

class Masks : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"a.png", "b.png"}) write_png(folder_ / name, test::pattern(20, 10, 3));
    capture_.emplace(import_list(folder_, {folder_ / "a.png", folder_ / "b.png"}));
    fs::create_directory(folder_ / "masks");
  }
  Image half(int width, int height, int channels, PixelType type = PixelType::u8) {
    Image one(width, height, 1);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width / 2; ++x) one.row<std::uint8_t>(y)[x] = 255;
    return converted(one, type, channels);
  }
  test::TemporaryFolder folder_;
  std::optional<Capture> capture_;
  Job job_;
};

TEST_F(Masks, GreyColouredGreySixteenBitAndAlphaAreRead) {
  write_png(folder_ / "masks/a.png", half(20, 10, 1, PixelType::u16));
  write_png(folder_ / "masks/b.png.png", half(20, 10, 3));  // named after the whole file name
  EXPECT_EQ(import_masks(*capture_, folder_ / "masks", job_), 2);
  for (const std::size_t i : {0u, 1u}) {
    const Image mask = capture_->read_mask(i);
    EXPECT_EQ(mask.row<std::uint8_t>(3)[9], 255);
    EXPECT_EQ(mask.row<std::uint8_t>(3)[10], 0);
    EXPECT_EQ(Capture::open(folder_ / "capture").mask_state(capture_->shots[i]), MaskSource::imported);
  }
  // An alpha channel is the mask, whatever the colours.
  Image rgba = test::pattern(20, 10, 4);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) rgba.row<std::uint8_t>(y)[4 * x + 3] = std::uint8_t(x);
  write_png(folder_ / "masks/a.png", rgba);
  EXPECT_EQ(import_masks(*capture_, folder_ / "masks", job_), 2);
  EXPECT_EQ(capture_->read_mask(0).row<std::uint8_t>(3)[7], 7);
}

TEST_F(Masks, WrongOnesAreErrorsBeforeAnyIsWritten) {
  const auto error = [&] { return expect_error([&] { import_masks(*capture_, folder_ / "masks", job_); }); };
  EXPECT_EQ(error().code(), ErrorCode::not_found);
  write_png(folder_ / "masks/stranger.png", half(20, 10, 1));
  EXPECT_EQ(error().code(), ErrorCode::not_found);
  write_png(folder_ / "masks/a.png", half(20, 10, 1));
  write_png(folder_ / "masks/b.png", half(21, 10, 1));
  EXPECT_THAT(error().what(), testing::HasSubstr("21 x 10"));
  EXPECT_THAT(error().what(), testing::Not(testing::HasSubstr("turned")));
  write_png(folder_ / "masks/b.png", half(10, 20, 1));
  EXPECT_THAT(error().what(), testing::HasSubstr("not turned as the camera was held"));
  EXPECT_EQ(capture_->mask_state(capture_->shots[0]), MaskSource::none);
  write_png(folder_ / "masks/b.png", test::pattern(20, 10, 3));
  EXPECT_THAT(error().what(), testing::HasSubstr("colour picture"));
  fs::copy_file(folder_ / "masks/a.png", folder_ / "masks/a.bmp");
  EXPECT_THAT(error().what(), testing::HasSubstr("two masks for photograph a"));
  EXPECT_EQ(expect_error([&] { import_masks(*capture_, folder_ / "nowhere", job_); }).code(), ErrorCode::not_found);
  EXPECT_FALSE(fs::exists(folder_ / "capture/masks/a.png"));
}

TEST_F(Masks, StrangersAreNoted) {
  write_png(folder_ / "masks/a.png", half(20, 10, 1));
  write_png(folder_ / "masks/stranger.png", half(20, 10, 1));
  EXPECT_EQ(import_masks(*capture_, folder_ / "masks", job_), 1);
  EXPECT_THAT(capture_->notes.back(), testing::HasSubstr("stranger.png"));
}

}  // namespace
}  // namespace lumihull
