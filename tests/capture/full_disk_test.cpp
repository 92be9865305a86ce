// A disk of its own that runs full at any moment of a capture: a word that names the file, a safe state, and nothing
// lost or half-written once there is room again.

#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/land_card.h>
#include <sys/mount.h>
#include <sys/statvfs.h>

#include <fstream>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A small file system in memory, where one may be mounted (by root).
class SmallDisk {
 public:
  explicit SmallDisk(std::size_t bytes)
      : mounted_(::mount("tmpfs", place_.path().c_str(), "tmpfs", 0, ("size=" + std::to_string(bytes)).c_str()) == 0) {}
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (mounted_) ::umount2(path().c_str(), MNT_DETACH);
  }

  bool mounted() const { return mounted_; }
  const fs::path& path() const { return place_.path(); }

  /// Fills it up to so many bytes, in whole blocks.
  void leave(std::size_t bytes) const {
    make_room();
    struct statvfs disk {};
    ASSERT_EQ(::statvfs(path().c_str(), &disk), 0);
    const std::size_t left = std::size_t(disk.f_bavail) * disk.f_bsize;
    ASSERT_GE(left, bytes);
    std::ofstream(path() / "ballast") << std::string(left - bytes, 'x');
  }
  void make_room() const { fs::remove(path() / "ballast"); }

 private:
  const test::TemporaryFolder place_;
  bool mounted_;
};

std::string text_of(const Plan& plan) {
  const test::TemporaryFolder aside;
  write_plan(plan, aside / "plan.json");
  return read_file(aside / "plan.json");
}

/// Each file is one that the capture keeps, and whole; what is still on its way lies in incoming/, or is marked as
/// such.
void expect_nothing_half_written(const test::Scene& scene) {
  if (!fs::exists(scene.folder)) return;
  const fs::path journal = journal_path(scene.folder);
  if (fs::exists(plan_path(scene.folder))) {
    EXPECT_EQ(read_file(plan_path(scene.folder)), text_of(scene.plan));
  }
  if (fs::exists(scene.folder / "capture.json")) {
    EXPECT_NO_THROW(Capture::open(scene.folder));
  }
  if (fs::exists(scene.folder / "contact.html")) {
    EXPECT_THAT(read_file(scene.folder / "contact.html"), testing::EndsWith("</html>\n"));
  }
  std::map<std::string, std::string> digests;
  if (fs::exists(journal) && fs::file_size(journal) > 0) {
    const JournalState state = read_journal(journal);
    for (const ShotProgress& shot : state.shots)
      for (const Take& take : shot.landed) digests[take.file] = take.sha256;
  }
  if (!fs::exists(scene.folder / "photos")) return;
  for (const auto& entry : fs::directory_iterator(scene.folder / "photos")) {
    const std::string name = entry.path().filename().string();
    ASSERT_TRUE(digests.contains(name)) << name << " is in photos/, and the journal does not know it";
    EXPECT_EQ(sha256_of_file(entry.path()), digests[name]) << name;
  }
}

TEST(FullDisk, AtAnyMomentNothingIsLostOrHalfWritten) {
  constexpr std::size_t kBlock = 4096;
  const SmallDisk disk(std::size_t(1) << 20);
  if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a disk in memory";
  const test::TemporaryFolder machines;
  std::map<std::string, int> named;  // which files were named, without numbers
  std::size_t stopped = 0;
  for (std::size_t room = 0; room < 40 * kBlock; room += kBlock) {
    SCOPED_TRACE(room);
    test::Scene scene(machines / std::to_string(room), test::turntable_plan(4));
    scene.folder = disk.path() / "object";
    scene.options.least_free_bytes = 0;
    scene.options.page_every_s = 0;
    disk.leave(room);
    try {
      scene.run();
    } catch (const Error& e) {
      ++stopped;
      EXPECT_EQ(e.code(), ErrorCode::io) << e.what();
      EXPECT_THAT(e.what(), HasSubstr("No space left on device"));
      EXPECT_THAT(e.what(), HasSubstr(disk.path().string())) << "names no file";
      std::string name = e.subject().substr(std::min(e.subject().size(), disk.path().string().size()));
      ++named[name];
    }
    EXPECT_TRUE(scene.ended_safe);
    expect_nothing_half_written(scene);
    // The same command, and the disk still full: the same word.
    if (room % (8 * kBlock) == 0 && stopped > 0) {
      disk.leave(0);
      try {
        scene.run();
      } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr(disk.path().string()));
      }
      EXPECT_TRUE(scene.ended_safe);
      expect_nothing_half_written(scene);
    }
    disk.make_room();
    scene.run();
    scene.expect_complete();
    EXPECT_EQ(scene.who.count(Question::About::doubt), 0u) << "the camera keeps a list";
    EXPECT_EQ(scene.exposures("main").size(), 4u) << "an exposure was made again";
    expect_nothing_half_written(scene);
    for (const auto& entry : fs::recursive_directory_iterator(scene.folder))
      EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr(".part-"))) << entry.path();
    fs::remove_all(scene.folder);
  }
  EXPECT_GT(stopped, 8u);
  for (const auto& [name, times] : named) RecordProperty(name, times);
}

TEST(FullDisk, ACardIsLandedInSeveralGoes) {
  const SmallDisk disk(std::size_t(1) << 20);
  if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a disk in memory";
  const test::TemporaryFolder machines;
  test::Scene scene(machines.path(), test::turntable_plan(6));
  scene.folder = disk.path() / "object";
  scene.options.least_free_bytes = 0;
  scene.delivers = false;
  EXPECT_EQ(scene.run().awaited, 6u);
  const fs::path card = scene.memory / "card";
  for (int i = 1; i <= 6; ++i)  // one file's RAW may not fit where its JPEG did
    write_file(card / ("IMG_" + std::to_string(i) + ".NEF"), std::string(9000, char('a' + i)));
  Job job;
  std::size_t goes = 0;
  for (std::size_t room = 0; room < 160 * 1024; room += 4096) {
    SCOPED_TRACE(room);
    disk.leave(room);
    try {
      land_card(scene.folder, card, {}, {}, job);
    } catch (const Error& e) {
      ++goes;
      EXPECT_EQ(e.code(), ErrorCode::io) << e.what();
      EXPECT_THAT(e.what(), HasSubstr("No space left on device"));
      EXPECT_THAT(e.what(), HasSubstr(scene.folder.string()));
    }
  }
  EXPECT_GT(goes, 4u);
  disk.make_room();
  const LandedCard last = land_card(scene.folder, card, {}, {}, job);
  EXPECT_EQ(last.landed, 0u);
  EXPECT_TRUE(last.troubles.empty());
  std::size_t jpegs = 0;
  for (const ShotProgress& shot : scene.state().shots) {
    ASSERT_EQ(shot.step, ShotStep::landed);
    const Take& take = shot.landed.back();
    EXPECT_EQ(sha256_of_file(scene.folder / "photos" / take.file), take.sha256);
    EXPECT_EQ(read_file((scene.folder / "photos" / take.file).replace_extension(".NEF")),
              std::string(9000, char('a' + int(take.shot))));
    ++jpegs;
  }
  EXPECT_EQ(std::size_t(std::distance(fs::directory_iterator(scene.folder / "photos"), {})), 2 * jpegs);
  EXPECT_EQ(Capture::open(scene.folder).shots.size(), 6u);
  EXPECT_TRUE(fs::is_empty(scene.folder / "incoming") || !fs::exists(scene.folder / "incoming"));
}

TEST(FullDisk, APlanIsWrittenWholeOrNotAtAll) {
  const SmallDisk disk(std::size_t(1) << 18);
  if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a disk in memory";
  const Plan old = test::cable_plan(3, 2), plan = test::cable_plan(12, 8);
  const fs::path file = disk.path() / "plan.json";
  const std::string before = text_of(old), after = text_of(plan);
  write_plan(old, file);
  for (std::size_t room = 0; room < after.size() - 4096; room += 8192) {
    disk.leave(room);
    const Error e = test::expect_error([&] { write_plan(plan, file); });
    EXPECT_EQ(e.code(), ErrorCode::io);
    EXPECT_THAT(e.what(), HasSubstr("plan.json"));
    EXPECT_EQ(read_file(file), before);
    disk.make_room();
    EXPECT_EQ(std::distance(fs::directory_iterator(disk.path()), {}), 1) << "something was left behind";
  }
  write_plan(plan, file);
  EXPECT_EQ(read_file(file), after);
}

}  // namespace
}  // namespace lumihull::capture
