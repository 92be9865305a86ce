// Cards as cameras, people and enemies leave them; copies that never replace anything.

#include <fcntl.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/ingest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <ctime>

#include "../base/picture_files.h"
#include "support.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;

std::string exif_time(double unix_s) {
  const auto t = std::time_t(unix_s);
  std::tm tm{};
  ::gmtime_r(&t, &tm);
  char text[32];
  std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &tm);
  return text;
}

/// Different bytes for each seed.
std::string jpeg(double unix_s, int seed, const std::string& fraction = "") {
  Image image(16, 8, 3);
  for (int x = 0; x < 16 * 3; ++x) image.row<std::uint8_t>(3)[x] = std::uint8_t(x * seed);
  image.row<std::uint8_t>(0)[0] = std::uint8_t(seed >> 8);
  test::ExifBuilder exif;
  exif.ascii(false, 0x0110, "L-1");
  if (unix_s > 0) exif.ascii(true, 0x9003, exif_time(unix_s));
  if (!fraction.empty()) exif.ascii(true, 0x9291, fraction);
  return test::jpeg_with_exif(encode_jpeg(image), exif.tiff());
}

constexpr double kStart = 1.6e9, kCameraAhead = 7200 - 13;

class Ingest : public ::testing::Test {
 protected:
  /// Shots at irregular times, and their pictures P1000001.JPG, … on the card.
  void make_card(int count) {
    fs::create_directories(card / "DCIM/100LUMIX");
    double t = kStart;
    for (int i = 0; i < count; ++i) {
      t += 9 + (i * 7919) % 11;
      char name[32];
      std::snprintf(name, sizeof name, "P100%04d.JPG", i + 1);
      files.push_back(card / "DCIM/100LUMIX" / name);
      bytes.push_back(jpeg(t + kCameraAhead, i + 1));
      write_file(files.back(), bytes.back());
      shots.push_back({"a" + std::to_string(i), "main", "", t, ShotState::done});
    }
  }
  Assignment run(const IngestOptions& options = {}) { return ingest(photos.path(), card.path(), shots, options, job); }

  struct Folder : test::TemporaryFolder {
    fs::path operator/(const std::string& name) const { return path() / name; }
  };
  Folder card, photos;
  std::vector<fs::path> files;
  std::vector<std::string> bytes;
  std::vector<ExpectedShot> shots;
  Job job;
};

TEST_F(Ingest, CopiesEachPictureToItsShot) {
  make_card(30);
  fs::remove(files[11]);
  const Assignment a = run();
  ASSERT_EQ(a.photos.size(), 29u);
  EXPECT_EQ(a.alignment.missing, std::vector<std::size_t>{11});
  EXPECT_NEAR(a.alignment.clocks.at(0).offset_s, kCameraAhead, 1);
  for (const IngestedPhoto& p : a.photos) {
    EXPECT_EQ(p.trouble, "");
    EXPECT_EQ(p.to[0], shots[p.shot].stop + ".jpg");
    EXPECT_EQ(read_file(photos.path() / p.to[0]), bytes[p.shot]);
    EXPECT_EQ(p.sha256, std::vector<std::string>{sha256(bytes[p.shot])});
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(photos.path()), {}), 29);
}

TEST_F(Ingest, AgainChangesNothingAndADryRunNothingAtAll) {
  make_card(12);
  IngestOptions dry;
  dry.dry_run = true;
  EXPECT_EQ(run(dry).photos.size(), 12u);
  EXPECT_TRUE(fs::is_empty(photos.path()));
  run();
  const auto before = fs::last_write_time(photos / "a3.jpg");
  write_file(photos / "a3.jpg.part-0", "left by a run that was killed");
  fs::remove(photos / "a4.jpg");
  const Assignment again = run();
  for (const IngestedPhoto& p : again.photos) EXPECT_EQ(p.was_there, p.to[0] != "a4.jpg");
  EXPECT_EQ(fs::last_write_time(photos / "a3.jpg"), before);
  EXPECT_EQ(read_file(photos / "a4.jpg"), bytes[4]);
}

TEST_F(Ingest, NeverReplacesAFile) {
  make_card(8);
  write_file(photos / "a2.jpg", "somebody's");
  fs::create_symlink(photos / "elsewhere", photos / "a3.jpg");
  fs::create_directory(photos / "a4.jpg");
  const Assignment a = run();
  for (const IngestedPhoto& p : a.photos) {
    const bool taken = p.to[0] == "a2.jpg" || p.to[0] == "a3.jpg" || p.to[0] == "a4.jpg";
    EXPECT_EQ(!p.trouble.empty(), taken) << p.to[0];
    EXPECT_EQ(p.sha256.empty(), taken);
  }
  EXPECT_EQ(read_file(photos / "a2.jpg"), "somebody's");
  EXPECT_FALSE(fs::exists(photos / "elsewhere"));
}

TEST_F(Ingest, RawAndJpegGoTogether) {
  make_card(6);
  for (std::size_t i = 0; i < files.size(); ++i)
    write_file(fs::path(files[i]).replace_extension(".RW2"), "raw data " + std::to_string(i));
  const Assignment a = run();
  ASSERT_EQ(a.photos.size(), 6u);
  for (const IngestedPhoto& p : a.photos) {
    ASSERT_EQ(p.to.size(), 2u);
    EXPECT_EQ(p.to[1], shots[p.shot].stop + ".rw2");
    EXPECT_EQ(read_file(photos.path() / p.to[1]), "raw data " + std::to_string(p.shot));
  }
}

TEST_F(Ingest, CamerasAreIngestedOneByOne) {
  make_card(10);
  for (std::size_t i = 0; i < 10; ++i) {
    shots.push_back(shots[i]);
    shots.back().camera = "side";
  }
  EXPECT_THAT(test::expect_error([&] { run(); }).what(), testing::HasSubstr("main, side"));
  IngestOptions o;
  o.camera = "top";
  EXPECT_EQ(test::expect_error([&] { run(o); }).code(), ErrorCode::invalid_argument);
  o.camera = "side";
  const Assignment a = run(o);
  ASSERT_EQ(a.photos.size(), 10u);
  for (const IngestedPhoto& p : a.photos) EXPECT_GE(p.shot, 10u);
  EXPECT_TRUE(fs::exists(photos / "a0-side.jpg"));
}

TEST_F(Ingest, NamesOfShotsArePlain) {
  make_card(3);
  for (const char* name : {"../a", "a/b", ".a", "a\nb", "\xff"}) {
    shots[1].name = name;
    EXPECT_EQ(test::expect_error([&] { run(); }).code(), ErrorCode::invalid_argument) << name;
  }
  shots[1].name = "a2";
  EXPECT_EQ(test::expect_error([&] { run(); }).code(), ErrorCode::invalid_argument);
}

TEST_F(Ingest, DamagedPicturesAreToldNotCopied) {
  make_card(10);
  write_file(files[3], bytes[3].substr(0, bytes[3].size() - 40));  // its header is sound
  write_file(files[5], "this is no JPEG");
  write_file(files[7], "");
  const Assignment a = run();
  std::size_t troubled = 0;
  for (const IngestedPhoto& p : a.photos) {
    if (p.trouble.empty()) continue;
    ++troubled;
    EXPECT_FALSE(fs::exists(photos.path() / p.to[0]));
  }
  // Those without a time are matched by order, for the counter runs on; and all three are named.
  EXPECT_EQ(a.photos.size(), 10u);
  EXPECT_EQ(troubled, 2u);
  EXPECT_THAT(a.card.notes, testing::Contains(testing::HasSubstr("P1000006.JPG: not a JPEG")));
  EXPECT_THAT(a.card.notes, testing::Contains(testing::HasSubstr("P1000008.JPG: an empty file")));
}

TEST_F(Ingest, LinksPipesAndStrangeNamesAreHarmless) {
  make_card(6);
  fs::create_symlink("/etc/passwd", card / "DCIM/100LUMIX/P1000099.JPG");
  fs::create_directory_symlink("/", card / "DCIM/101LUMIX");
  ASSERT_EQ(::mkfifo((card / "DCIM/100LUMIX/P1000098.JPG").c_str(), 0600), 0);
  write_file(card / "DCIM/100LUMIX/._P1000001.JPG", "of another system");
  write_file(card / "DCIM/100LUMIX/\x1b[2J\n\xff.JPG", "no picture");
  write_file(card / "DCIM/100LUMIX/README.TXT", "no picture");
  fs::create_directory(card / "DCIM/100LUMIX/P1000097.JPG");
  const Assignment a = run();
  EXPECT_EQ(a.photos.size(), 6u);
  EXPECT_THAT(a.card.notes, testing::Contains(testing::HasSubstr("2 links were passed over")));
  EXPECT_THAT(a.card.notes, testing::Contains(testing::HasSubstr("1 pipes or devices")));
  for (const std::string& note : a.card.notes) EXPECT_EQ(note.find_first_of("\n\x1b\xff"), std::string::npos) << note;
}

TEST_F(Ingest, WhatIsNoCardIsAnError) {
  EXPECT_EQ(test::expect_error([&] { read_card(card / "nowhere", job); }).code(), ErrorCode::not_found);
  write_file(card / "file", "");
  EXPECT_EQ(test::expect_error([&] { read_card(card / "file", job); }).code(), ErrorCode::bad_input);
  fs::path deep = card.path();
  for (int i = 0; i < 20; ++i) deep /= "d";
  fs::create_directories(deep);
  EXPECT_THAT(test::expect_error([&] { read_card(card.path(), job); }).what(), testing::HasSubstr("deeper than 16"));
  make_card(2);
  EXPECT_EQ(test::expect_error([&] { ingest(photos / "nowhere", card / "DCIM", shots, {}, job); }).code(),
            ErrorCode::not_found);
  Job stopped;
  stopped.cancel();
  EXPECT_EQ(test::expect_error([&] { read_card(card / "DCIM", stopped); }).code(), ErrorCode::cancelled);
}

TEST_F(Ingest, MoreFilesThanAnyCardHasIsAnError) {
  for (int i = 0; i < 50'001; ++i) {
    const int descriptor = ::open((card.path() / std::to_string(i)).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    ASSERT_GE(descriptor, 0);
    ::close(descriptor);
  }
  EXPECT_THAT(test::expect_error([&] { read_card(card.path(), job); }).what(), testing::HasSubstr("more than 50000"));
}

// ---- what a card tells ----

TEST_F(Ingest, CountersWrapWithinAndOverFolders) {
  const auto put = [&](const std::string& name) {
    fs::create_directories((card / name).parent_path());
    write_file(card / name, jpeg(kStart, 1));
  };
  for (const char* name :
       {"DCIM/100CANON/IMG_9998.JPG", "DCIM/100CANON/IMG_9999.JPG", "DCIM/100CANON/IMG_0001.JPG",
        "DCIM/100CANON/IMG_0002.JPG", "DCIM/101CANON/IMG_0003.JPG", "MISC/shot10.jpg", "MISC/shot9.jpg"})
    put(name);
  std::string order;
  for (const CardPicture& p : read_card(card.path(), job).pictures) order += p.files[0].filename().string() + " ";
  EXPECT_EQ(order, "IMG_9998.JPG IMG_9999.JPG IMG_0001.JPG IMG_0002.JPG IMG_0003.JPG shot9.jpg shot10.jpg ");
}

TEST_F(Ingest, FractionsAndZonesAreUsedWhereAllHaveThem) {
  write_file(card / "IMG_0001.JPG", jpeg(kStart, 1, "25"));
  write_file(card / "IMG_0002.JPG", jpeg(kStart + 7, 2, "5"));
  Card c = read_card(card.path(), job);
  EXPECT_DOUBLE_EQ(c.pictures[0].clock_s.value(), kStart + 0.25);
  EXPECT_DOUBLE_EQ(c.pictures[1].clock_s.value(), kStart + 7.5);
  EXPECT_EQ(c.pictures[0].resolution_s, 0.01);
  write_file(card / "IMG_0003.JPG", jpeg(kStart + 9, 3));
  c = read_card(card.path(), job);
  EXPECT_DOUBLE_EQ(c.pictures[0].clock_s.value(), kStart);
  EXPECT_EQ(c.pictures[0].resolution_s, 1);
  EXPECT_EQ(c.pictures[0].model, "L-1");
}

TEST_F(Ingest, AClockThatStandsStillIsNotBelieved) {
  make_card(9);
  for (std::size_t i = 0; i < files.size(); ++i) write_file(files[i], bytes[i] = jpeg(946684800, int(i) + 1));
  const Assignment a = run();
  EXPECT_THAT(a.card.notes, testing::Contains(testing::HasSubstr("stood still")));
  ASSERT_EQ(a.photos.size(), 9u);  // by order: as many as shots, without a hole
  for (const IngestedPhoto& p : a.photos) EXPECT_TRUE(p.by_order);
}

TEST_F(Ingest, ImpossibleDatesAreNone) {
  test::ExifBuilder exif;
  exif.ascii(true, 0x9003, "2021:02:30 10:00:00");
  write_file(card / "IMG_0001.JPG", test::jpeg_with_exif(encode_jpeg(Image(8, 8, 3)), exif.tiff()));
  EXPECT_FALSE(read_card(card.path(), job).pictures.at(0).clock_s);
}

}  // namespace
}  // namespace lumihull::capture
