// A watched folder: whole pictures, half ones, false ones.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/camera_devices.h>

#include <fstream>
#include <thread>

#include "support.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;

std::string jpeg(int seed) {
  Image image(64, 48, 3);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64 * 3; ++x) image.row<std::uint8_t>(y)[x] = std::uint8_t(x * y * seed);
  return encode_jpeg(image);
}

void append(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::app | std::ios::binary) << bytes;
}

class FolderCamera : public ::testing::Test {
 protected:
  /// Shoots once while `writer` runs as the other program.
  ShotOutcome shoot(const std::function<void()>& writer, ShotId id = 1) {
    if (!device) device = watch_folder(options());
    std::jthread other;
    release = [&] {
      ++released;
      other = std::jthread(writer);
      return true;
    };
    return device->shoot(id, 0, photos.path(), job);
  }
  FolderCameraOptions options() {
    FolderCameraOptions o;
    o.watched = watched.path();
    o.release = [this](ShotId, double) { return release(); };
    o.timeout_s = 1.5;
    o.quiet_s = 0.4;
    o.pair_s = 0.4;
    return o;
  }
  static void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

  test::TemporaryFolder watched, photos;
  std::function<bool()> release;
  std::unique_ptr<CameraDevice> device;
  int released = 0;
  Job job;
};

TEST_F(FolderCamera, TakesTheOneNewPicture) {
  write_file(watched / "old.jpg", jpeg(1));
  for (ShotId id = 1; id <= 3; ++id) {
    const ShotOutcome outcome =
        shoot([&] { write_file(watched / ("DSC_000" + std::to_string(id) + ".JPG"), jpeg(int(id) + 1)); }, id);
    EXPECT_EQ(outcome.state, ShotState::done) << outcome.detail;
    ASSERT_EQ(outcome.file, photos / ("shot-00000" + std::to_string(id) + ".jpg"));
    EXPECT_EQ(read_file(outcome.file), jpeg(int(id) + 1));
    EXPECT_EQ(outcome.detail, "");
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(watched.path()), {}), 1);  // the old one alone
}

TEST_F(FolderCamera, AnOverwrittenNameIsNew) {
  write_file(watched / "last.jpg", jpeg(1));
  EXPECT_EQ(read_file(shoot([&] { write_file(watched / "last.jpg", jpeg(2)); }).file), jpeg(2));
}

TEST_F(FolderCamera, WaitsForTheWholeFile) {
  const std::string bytes = jpeg(3);
  const ShotOutcome outcome = shoot([&] {
    // Each piece is written and closed, as a slow copy may: the content alone tells that it is not the end.
    for (std::size_t at = 0; at < bytes.size(); at += bytes.size() / 5 + 1) {
      append(watched / "slow.jpg", bytes.substr(at, bytes.size() / 5 + 1));
      sleep_ms(150);
    }
  });
  EXPECT_EQ(outcome.state, ShotState::done) << outcome.detail;
  EXPECT_EQ(read_file(outcome.file), bytes);
}

TEST_F(FolderCamera, HalfAPictureIsNone) {
  const ShotOutcome outcome = shoot([&] { write_file(watched / "half.jpg", jpeg(3).substr(0, 700)); });
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_THAT(outcome.detail, testing::HasSubstr("half.jpg: a JPEG that stops in the middle"));
}

TEST_F(FolderCamera, NothingComes) {
  ShotOutcome outcome = shoot([] {});
  EXPECT_EQ(outcome.state, ShotState::unknown);
  EXPECT_EQ(outcome.detail, "no picture came in time");
  EXPECT_EQ(device->recall(1).state, ShotState::unknown);
  EXPECT_EQ(device->shoot(1, 0, photos.path(), job).state, ShotState::unknown);
  EXPECT_EQ(released, 1);  // not asked again
  outcome = shoot([&] { write_file(watched / "a.jpg", jpeg(1)); }, 2);
  EXPECT_THAT(outcome.detail, testing::HasSubstr("this one may be it"));
  outcome = shoot([&] { write_file(watched / "b.jpg", jpeg(2)); }, 3);
  EXPECT_EQ(outcome.detail, "");
}

TEST_F(FolderCamera, TemporaryAndStrangeNamesAreNotPictures) {
  const ShotOutcome outcome = shoot([&] {
    for (const char* name :
         {".a.jpg.Xy7", "a.jpg.part", "a.jpg.crdownload", "~a.jpg", ".syncthing.a.jpg", "a.xmp", "a.txt"})
      write_file(watched / name, jpeg(1));
    fs::create_symlink("/etc/passwd", watched / "link.jpg");
    fs::create_directory(watched / "folder.jpg");
    write_file(watched / "a\n\x1b[2J.jpg.part", jpeg(1));
    fs::rename(watched / "a.jpg.part", watched / "a.jpg");
  });
  EXPECT_EQ(outcome.state, ShotState::done) << outcome.detail;
  EXPECT_EQ(read_file(outcome.file), jpeg(1));
  EXPECT_FALSE(fs::exists(watched / "a.jpg"));
}

TEST_F(FolderCamera, RawAndJpegAreOnePicture) {
  const ShotOutcome outcome = shoot([&] {
    write_file(watched / "IMG_1.CR2", "II*\0 sensor data");
    sleep_ms(100);
    write_file(watched / "IMG_1.JPG", jpeg(5));
  });
  EXPECT_EQ(outcome.file, photos / "shot-000001.jpg") << outcome.detail;
  EXPECT_TRUE(fs::exists(photos / "shot-000001.cr2"));
}

TEST_F(FolderCamera, TheSamePictureTwiceIsOne) {
  const ShotOutcome outcome = shoot([&] {
    write_file(watched / "IMG_1.JPG", jpeg(5));
    write_file(watched / "IMG_1 (1).JPG", jpeg(5));
  });
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_EQ(read_file(outcome.file), jpeg(5));
}

TEST_F(FolderCamera, TwoPicturesAreNotGuessedAt) {
  const ShotOutcome outcome = shoot([&] {
    write_file(watched / "IMG_1.JPG", jpeg(5));
    write_file(watched / "IMG_2.JPG", jpeg(6));
  });
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_TRUE(outcome.file.empty());
  EXPECT_TRUE(fs::exists(watched / "IMG_1.JPG") && fs::exists(watched / "IMG_2.JPG"));
}

TEST_F(FolderCamera, NeverReplacesAndNeverLosesAPicture) {
  write_file(photos / "shot-000001.jpg", "somebody's");
  EXPECT_EQ(shoot([&] { write_file(watched / "a.jpg", jpeg(5)); }).file, photos / "shot-000001-2.jpg");
  EXPECT_EQ(read_file(photos / "shot-000001.jpg"), "somebody's");
  fs::remove_all(photos.path());
  const ShotOutcome outcome = shoot([&] { write_file(watched / "b.jpg", jpeg(6)); }, 2);
  EXPECT_EQ(outcome.state, ShotState::done);
  EXPECT_THAT(outcome.detail, testing::HasSubstr("stays in"));
  EXPECT_EQ(read_file(watched / "b.jpg"), jpeg(6));
  fs::create_directory(photos.path());
}

TEST_F(FolderCamera, DeclinedCancelledAndWrongUse) {
  device = watch_folder(options());
  release = [] { return false; };
  EXPECT_EQ(device->shoot(1, 0, photos.path(), job).state, ShotState::refused);
  release = [this] {
    job.cancel();
    return true;
  };
  EXPECT_EQ(device->shoot(1, 0, photos.path(), job).detail, "stopped before a picture came");
  EXPECT_EQ(test::expect_error([&] { device->shoot(2, 0, photos.path(), job); }).code(), ErrorCode::cancelled);
  Job fresh;
  EXPECT_EQ(test::expect_error([&] { device->shoot(2, -1, photos.path(), fresh); }).code(),
            ErrorCode::invalid_argument);
  FolderCameraOptions o = options();
  o.watched = watched / "nowhere";
  EXPECT_EQ(test::expect_error([&] { watch_folder(o); }).code(), ErrorCode::not_found);
  write_file(watched / "file", "");
  o.watched = watched / "file";
  EXPECT_EQ(test::expect_error([&] { watch_folder(o); }).code(), ErrorCode::invalid_argument);
  o = options();
  o.quiet_s = -1;
  EXPECT_EQ(test::expect_error([&] { watch_folder(o); }).code(), ErrorCode::invalid_argument);
  fs::remove_all(watched.path());
  EXPECT_EQ(test::expect_error([&] { device->shoot(3, 0, photos.path(), fresh); }).code(), ErrorCode::io);
  fs::create_directory(watched.path());
}

}  // namespace
}  // namespace lumihull::capture
