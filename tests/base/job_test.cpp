#include <lumihull/base/job.h>
#include <lumihull/base/parallel.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <numeric>
#include <vector>

#include "support.h"

namespace lumihull {
namespace {

TEST(Job, ReportsOnItsOwnersThreadAndEndsAtTheTotal) {
  const auto owner = std::this_thread::get_id();
  std::vector<Progress> reports;
  bool foreign = false;
  Job job(
      [&](const Progress& p) {
        foreign |= std::this_thread::get_id() != owner;
        reports.push_back(p);
      },
      4);
  job.begin("counting", 1000);
  parallel_for(
      job, 1000, [](std::size_t) { std::this_thread::sleep_for(std::chrono::microseconds(500)); }, true);
  job.end();
  EXPECT_FALSE(foreign);
  ASSERT_GE(reports.size(), 3u);  // begin, some on the way, end
  EXPECT_EQ(reports.front().done, 0u);
  EXPECT_LT(reports.front().eta_s, 0);
  EXPECT_EQ(reports.back().done, 1000u);
  EXPECT_EQ(reports.back().stage, "counting");
  EXPECT_EQ(reports.back().eta_s, 0);
  EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end(), [](auto& a, auto& b) { return a.done < b.done; }));
}

TEST(Job, CancelFromAnotherThreadStopsALoop) {
  Job job({}, 2);
  std::atomic<int> done{0};
  std::jthread other([&] {
    while (done < 10) std::this_thread::yield();
    job.cancel();
  });
  const Error e = test::expect_error([&] {
    parallel_for(job, 1'000'000, [&](std::size_t) {
      ++done;
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    });
  });
  EXPECT_EQ(e.code(), ErrorCode::cancelled);
  EXPECT_LT(done, 1'000'000);
  EXPECT_EQ(test::expect_error([&] { job.begin("next", 1); }).code(), ErrorCode::cancelled) << "the wish is sticky";
}

TEST(Parallel, EveryItemOnceForAnyNumberOfThreads) {
  for (const unsigned threads : {1u, 2u, 3u, 16u}) {
    Job job({}, threads);
    for (const std::size_t n : {0u, 1u, 7u, 1000u}) {
      std::vector<int> count(n, 0);
      parallel_chunks(job, n, 3, [&](std::size_t first, std::size_t last) {
        EXPECT_LE(last - first, 3u);
        EXPECT_EQ(first % 3, 0u);
        for (std::size_t i = first; i < last; ++i) ++count[i];
      });
      EXPECT_EQ(std::accumulate(count.begin(), count.end(), 0), int(n));
      EXPECT_EQ(std::count(count.begin(), count.end(), 1), long(n));
    }
  }
}

TEST(Parallel, WhereNoMoreThreadsAreToBeHadFewerDoItAll) {
  EXPECT_EQ(Job({}, 4'000'000'000u).threads(), 1024u);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's own memory is beyond any limit";
#endif
  const pid_t child = fork();
  if (child == 0) {
    // Room for a few stacks of 8 MB beside what is there, far from 1000.
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t room = pages * std::size_t(sysconf(_SC_PAGESIZE)) + (std::size_t(200) << 20);
    const rlimit limit{room, room};
    setrlimit(RLIMIT_AS, &limit);
    Job job({}, 1000);
    std::atomic<int> done{0};
    try {
      parallel_for(job, 3000, [&](std::size_t) {
        ++done;
        usleep(1000);
      });
    } catch (const std::exception&) {
      _exit(8);
    }
    _exit(done == 3000 ? 7 : 9);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST(Parallel, AnExceptionReachesTheCaller) {
  Job job({}, 4);
  const Error e = test::expect_error([&] {
    parallel_for(job, 1000, [](std::size_t i) {
      if (i == 137) throw Error(ErrorCode::bad_input, "number 137", "item");
    });
  });
  EXPECT_EQ(e.message(), "number 137");
  EXPECT_STREQ(e.what(), "item: number 137");
}

}  // namespace
}  // namespace lumihull
