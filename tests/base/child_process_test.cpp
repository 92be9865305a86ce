// Other programs as children.

#include <lumihull/internal/child_process.h>
#include <signal.h>

#include <chrono>

#include "support.h"

namespace lumihull {
namespace {

using internal::ChildProcess;

/// Whether a process of that number is there at all; an ended child that nobody waited for is.
bool exists(int pid) { return ::kill(pid, 0) == 0; }

TEST(ChildProcess, TellsLinesAndExitStatus) {
  Job job;
  std::vector<std::string> lines;
  const int status = internal::run_child({"sh", "-c", "echo one; echo two >&2; printf three; exit 7"}, job,
                                         [&](const std::string& line) { lines.push_back(line); });
  EXPECT_EQ(status, 7);
  EXPECT_EQ(lines, (std::vector<std::string>{"one", "two", "three"}));
  EXPECT_EQ(internal::run_child({"sh", "-c", "kill -9 $$"}, job, [](const std::string&) {}), 128 + 9);
  EXPECT_EQ(test::expect_error([&] { internal::run_child({"no-such-program-here"}, job, {}); }).code(),
            ErrorCode::not_found);
}

TEST(ChildProcess, ConversesAndSurvivesOneThatIsGone) {
  ChildProcess child({"sh", "-c", "read word; echo \"heard $word\"; echo dropped >&2"}, ChildProcess::Talk::converse);
  EXPECT_TRUE(child.write("hello\n", 1000));
  std::string text;
  while (child.read(text, 100)) {
  }
  EXPECT_EQ(text, "heard hello\n");
  EXPECT_EQ(child.wait(), 0);
  EXPECT_FALSE(child.write("again\n", 1000));  // and no SIGPIPE
}

TEST(ChildProcess, AnEarIsNotWaitedForForEver) {
  ChildProcess deaf({"sleep", "60"}, ChildProcess::Talk::converse);
  EXPECT_FALSE(deaf.write(std::string(10'000'000, 'x'), 200));
}

TEST(ChildProcess, EndsWhatHangsAndItsGroup) {
  int pid = 0;
  {
    // Deaf to SIGTERM, and with a child of its own.
    ChildProcess child({"sh", "-c", "trap '' TERM; sleep 61 & echo $!; wait; wait; sleep 62"});
    std::string text;
    while (text.find('\n') == std::string::npos) ASSERT_TRUE(child.read(text, 100));
    pid = std::stoi(text);
    EXPECT_TRUE(exists(child.pid()));
  }
  for (int i = 0; i < 100 && exists(pid); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(exists(pid));
}

}  // namespace
}  // namespace lumihull
