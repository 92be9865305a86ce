#include <lumihull/base/files.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <vector>

#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;

TEST(Files, WriteThenReadGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  const std::string bytes("a\0b\xff\n", 5);
  write_file(folder / "x", bytes);
  EXPECT_EQ(read_file(folder / "x"), bytes);
  write_file(folder / "x", "shorter");
  EXPECT_EQ(read_file(folder / "x"), "shorter");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "nothing temporary is left";
}

TEST(Files, ErrorsNameTheFileAndTheReason) {
  const test::TemporaryFolder folder;
  const Error missing = test::expect_error([&] { read_file(folder / "no"); });
  EXPECT_EQ(missing.code(), ErrorCode::not_found);
  EXPECT_EQ(missing.subject(), (folder / "no").string());
  EXPECT_EQ(test::expect_error([&] { read_file(folder.path()); }).code(), ErrorCode::bad_input);
  write_file(folder / "big", std::string(100, 'x'));
  EXPECT_THAT(test::expect_error([&] { read_file(folder / "big", 99); }).message(), testing::HasSubstr("99"));
  EXPECT_EQ(test::expect_error([&] { write_file(folder / "none" / "x", "y"); }).code(), ErrorCode::not_found);
}

TEST(Files, UncommittedFilesLeaveNothingBehind) {
  const test::TemporaryFolder folder;
  write_file(folder / "x", "old");
  {
    AtomicFile file(folder / "x");
    file.write("new");
  }
  EXPECT_EQ(read_file(folder / "x"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(Files, ANewFileNeverReplacesAnything) {
  const test::TemporaryFolder folder;
  {
    AtomicFile file(folder / "x");
    file.write("first");
    EXPECT_TRUE(file.commit_new());
  }
  {
    AtomicFile file(folder / "x");
    file.write("second");
    EXPECT_FALSE(file.commit_new());
  }
  fs::create_symlink(folder / "nowhere", folder / "link");  // in use, too
  {
    AtomicFile file(folder / "link");
    EXPECT_FALSE(file.commit_new());
  }
  EXPECT_EQ(read_file(folder / "x"), "first");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);
}

TEST(Files, AFullDiskIsAnErrorAndKeepsTheOldFile) {
  const test::TemporaryFolder folder;
  write_file(folder / "x", "old");
  // A limit on the size of files stands in for a full disk: write() fails in the same way, part way through.
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_file(folder / "x", std::string(100'000, 'y'));
    } catch (const Error& e) {
      _exit(e.code() == ErrorCode::io && e.subject() == (folder / "x").string() ? 7 : 8);
    }
    _exit(9);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_EQ(read_file(folder / "x"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(Files, KilledWhileWritingLeavesOldOrNew) {
  const test::TemporaryFolder folder;
  const std::string first(300'000, 'a'), second(300'000, 'b');
  write_file(folder / "x", first);
  for (int round = 0; round < 12; ++round) {
    const pid_t child = fork();
    if (child == 0) {
      for (;;) {
        write_file(folder / "x", second);
        write_file(folder / "x", first);
      }
    }
    usleep(useconds_t(3000 + 1700 * round));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const std::string now = read_file(folder / "x");
    EXPECT_TRUE(now == first || now == second) << "round " << round;
  }
  write_file(folder / "x", "end");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "the next write takes away what was left";
}

TEST(Files, AKilledWritersLeftoverGoesAndARunningOnesStays) {
  const test::TemporaryFolder folder;
  const auto files = [&] { return std::distance(fs::directory_iterator(folder.path()), {}); };
  const pid_t child = fork();
  if (child == 0) {
    AtomicFile half(folder / "x");
    half.write("half");
    kill(getpid(), SIGKILL);
  }
  waitpid(child, nullptr, 0);
  ASSERT_EQ(files(), 1) << "the killed process has left its unfinished file";
  AtomicFile running(folder / "x");
  running.write("slow");
  EXPECT_EQ(files(), 1) << "its place was taken";
  write_file(folder / "x", "fast");
  EXPECT_EQ(read_file(folder / "x"), "fast");
  EXPECT_EQ(files(), 2) << "nobody takes a file away that is being written";
  running.commit();
  EXPECT_EQ(read_file(folder / "x"), "slow");
  EXPECT_EQ(files(), 1);
}

TEST(Error, IsOneLineOfUtf8WhateverAFileHolds) {
  const Error e(ErrorCode::bad_input, "no camera \"a\nb\x1b[31m\xff\"", "tr\xc3\xa8s\x07/\xc2\x9b\xed\xa0\x80");
  EXPECT_EQ(e.message(), "no camera \"a?b?[31m?\"");
  EXPECT_EQ(e.subject(),
            "tr\xc3\xa8s?/?"
            "?"
            "?"
            "?"
            "?");
  EXPECT_EQ(e.what(), e.subject() + ": " + e.message());
}

TEST(Files, Sha256OfPublishedVectors) {
  // FIPS 180-4 examples.
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  const test::TemporaryFolder folder;
  const std::string big(1'000'000, 'a');
  write_file(folder / "a", big);
  EXPECT_EQ(sha256_of_file(folder / "a"), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Files, PeakMemoryFollowsTheProcess) {
  reset_peak_memory();
  const std::uint64_t before = peak_memory_bytes();
  ASSERT_GT(before, 0u);
  {
    std::vector<char> block(200'000'000, 1);
    EXPECT_EQ(block.back(), 1);
  }
  EXPECT_GT(peak_memory_bytes(), before + 150'000'000);
}

}  // namespace
}  // namespace lumihull
