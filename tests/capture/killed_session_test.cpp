// A capture that is killed again and again: nothing is lost, nothing is there twice, the order is the plan's.

#include <lumihull/base/files.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using About = Question::About;

struct Kills {
  int kills = 0;     ///< processes that were killed
  int doubts = 0;    ///< shots that were decided by the operator
  int resumed = 0;   ///< sessions that the journal knows
};

/// Runs the scene in child processes, each killed after a random time, until `kills` were; then to its end.
/// The operator of each process answers a doubt by "again"; questions of position by where the plan was.
Kills run_killed(test::Scene& scene, int kills, double longest_s, std::uint32_t seed) {
  std::mt19937 random(seed);
  Kills out;
  for (;;) {
    const pid_t child = fork();
    if (child == 0) {
      int status = 1;
      try {
        scene.who.answers[About::doubt] = {"again"};
        scene.run();
        status = 0;
      } catch (const std::exception& e) {
        std::ofstream(scene.memory / "errors", std::ios::app) << e.what() << "\n";
      }
      _exit(status);
    }
    if (out.kills < kills) {
      const double after = std::uniform_real_distribution<double>(0, longest_s)(random);
      std::this_thread::sleep_for(std::chrono::duration<double>(after));
      ::kill(child, SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) {
      ++out.kills;
      continue;
    }
    if (WEXITSTATUS(status) != 0) {
      ADD_FAILURE() << read_file(scene.memory / "errors");
      return out;
    }
    break;
  }
  const JournalState state = scene.state();
  out.resumed = int(state.sessions);
  return out;
}

/// The order in which the camera exposed: stops never go back, and only a stop in doubt comes twice.
void expect_planned_order(const test::Scene& scene, const std::string& camera) {
  std::size_t last = 0;
  for (const auto& e : scene.exposures(camera)) {
    std::size_t stop = 0;
    while (scene.plan.stops[stop].name != e.stop) ++stop;
    EXPECT_GE(stop, last) << e.stop;
    last = stop;
  }
}

class Killed : public testing::TestWithParam<bool> {};

TEST_P(Killed, At200Moments) {
  const bool recalls = GetParam();
  const test::TemporaryFolder folder;
  int kills = 0, sessions = 0;
  std::size_t twice = 0, shots = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint32_t run = 0; run < 2; ++run) {
    test::Scene scene(folder / std::to_string(run), test::turntable_plan(150, {"left", "right"}));
    scene.recalls = recalls;
    scene.options.page_every_s = 0.05;
    const Kills killed = run_killed(scene, 50, 0.15, 17 * run + recalls);
    kills += killed.kills;
    sessions += killed.resumed;
    scene.expect_complete();
    for (const std::string camera : {"left", "right"}) {
      expect_planned_order(scene, camera);
      const std::size_t exposed = scene.exposures(camera).size();
      EXPECT_GE(exposed, 150u);
      twice += exposed - 150;
      shots += 150;
    }
    // Each exposure beyond the planned is one that was in doubt, and that the operator let be made again.
    std::size_t decided = 0;
    std::ifstream journal(journal_path(scene.folder));
    for (std::string line; std::getline(journal, line);) decided += line.find("\"decided\"") != std::string::npos;
    std::size_t extra = 0;
    for (const std::string camera : {"left", "right"}) extra += scene.exposures(camera).size() - 150;
    EXPECT_LE(extra, decided);
    if (recalls) {
      EXPECT_EQ(decided, 0u);
    }
  }
  EXPECT_EQ(kills, 100);
  if (recalls) {
    EXPECT_EQ(twice, 0u);
  }
  std::printf("%d kills, %zu shots, %d sessions begun, %zu exposures made again after a doubt, %.0f s\n", kills, shots,
              sessions, twice,
              std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

INSTANTIATE_TEST_SUITE_P(Camera, Killed, testing::Values(true, false),
                         [](const auto& camera) { return std::string(camera.param ? "ThatRecalls" : "WithoutMemory"); });

TEST(KilledCables, ACablesRobotGoesOnFromBetweenTwoStops) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::cable_plan(6, 3));
  for (PlannedStop& stop : scene.plan.stops) stop.travel_s = 0.02;
  scene.who.answers[About::position] = {scene.plan.stops[0].name};
  const Kills killed = run_killed(scene, 12, 0.2, 5);
  EXPECT_EQ(killed.kills, 12);
  scene.expect_complete();
  expect_planned_order(scene, "main");
}

}  // namespace
}  // namespace lumihull::capture
