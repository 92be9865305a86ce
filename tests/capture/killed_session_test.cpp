// A capture that is killed again and again: nothing is lost, nothing is there twice, the order is the plan's.

#include <fcntl.h>
#include <lumihull/base/files.h>
#include <poll.h>
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
  int kills = 0;    ///< processes that were killed
  int resumed = 0;  ///< sessions that the journal knows
};

/// Runs the scene in child processes, each killed after a random time, until `kills` were; then to its end.
/// The operator of each process answers a doubt by "again"; questions of position by where the plan was.
Kills run_killed(test::Scene& scene, int kills, double longest_s, std::uint32_t seed) {
  std::mt19937 random(seed);
  Kills out;
  for (;;) {
    int moved[2];
    if (pipe2(moved, O_CLOEXEC) != 0) return out;
    const pid_t child = fork();
    if (child == 0) {
      int status = 1;
      try {
        scene.prepare = [&](capture::SimulatedRobot& robot, const std::vector<capture::SimulatedCamera*>&) {
          robot.on_move = [&](const PlannedStop&) { (void)!write(moved[1], "m", 1); };
        };
        scene.who.answers[About::doubt] = {"again"};
        scene.run();
        status = 0;
      } catch (const std::exception& e) {
        std::ofstream(scene.memory / "errors", std::ios::app) << e.what() << "\n";
      }
      _exit(status);
    }
    close(moved[1]);
    if (out.kills < kills) {
      // Every second one while it photographs, however long a process takes to begin.
      pollfd first{moved[0], POLLIN, 0};
      if (out.kills % 2) poll(&first, 1, 20000);
      const double after = std::uniform_real_distribution<double>(0, longest_s)(random);
      std::this_thread::sleep_for(std::chrono::duration<double>(after));
      ::kill(child, SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    close(moved[0]);
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

/// Where synchronising costs nothing, kills fall into all that happens, not only into waiting for the disk.
struct MemoryFolder {
  fs::path path = fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
  MemoryFolder() {
    std::string name = (path / "lumihull-killed-XXXXXX").string();
    if (mkdtemp(name.data())) path = name;
  }
  ~MemoryFolder() { fs::remove_all(path); }
};

class Killed : public testing::TestWithParam<bool> {};

TEST_P(Killed, At200Moments) {
  const bool recalls = GetParam();
  const MemoryFolder folder;
  int kills = 0, sessions = 0, captures = 0;
  std::size_t twice = 0, shots = 0, doubts = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint32_t run = 0; kills < 100; ++run) {
    test::Scene scene(folder.path / std::to_string(run), test::turntable_plan(150, {"left", "right"}));
    scene.recalls = recalls;
    scene.options.page_every_s = 0.2;
    for (PlannedStop& stop : scene.plan.stops) stop.exposure_s = 0.004;
    const Kills killed = run_killed(scene, std::min(40, 100 - kills), 0.15, 17 * run + recalls);
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
    ++captures;
    // Each exposure beyond the planned is one that was in doubt, and that the operator let be made again.
    std::size_t decided = 0;
    std::ifstream journal(journal_path(scene.folder));
    for (std::string line; std::getline(journal, line);) decided += line.find("\"decided\"") != std::string::npos;
    std::size_t extra = 0;
    for (const std::string camera : {"left", "right"}) extra += scene.exposures(camera).size() - 150;
    EXPECT_LE(extra, decided);
    doubts += decided;
    if (recalls) {
      EXPECT_EQ(decided, 0u);
    }
  }
  EXPECT_EQ(kills, 100);
  if (recalls) {
    EXPECT_EQ(twice, 0u);
  }
  std::printf(
      "%d kills in %d captures of %zu photographs in all, %d sessions begun, %zu doubts, %zu exposures made again, "
      "%.0f s\n",
      kills, captures, shots, sessions, doubts, twice,
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

INSTANTIATE_TEST_SUITE_P(Camera, Killed, testing::Values(true, false), [](const auto& camera) {
  return std::string(camera.param ? "ThatRecalls" : "WithoutMemory");
});

/// Not at random: by the devices themselves, in the midst of their work.
TEST(KilledAt, EachStepOfAShot) {
  for (const bool recalls : {true, false})
    for (const std::string moment : {"moving", "before the exposure", "half of the file", "after the file"}) {
      SCOPED_TRACE(moment + (recalls ? ", recalling" : ""));
      const MemoryFolder folder;
      test::Scene scene(folder.path, test::turntable_plan(6, {"left", "right"}));
      scene.recalls = recalls;
      const pid_t child = fork();
      if (child == 0) {
        scene.prepare = [&](capture::SimulatedRobot& robot, const std::vector<capture::SimulatedCamera*>& cameras) {
          const auto die_at = [](ShotId id) {
            if (id == 6) raise(SIGKILL);
          };
          const auto fault = [die_at](ShotId id) -> std::optional<ShotOutcome> { return die_at(id), std::nullopt; };
          if (moment == "moving")
            robot.on_move = [](const PlannedStop& stop) {
              if (stop.name == "a003-e00") raise(SIGKILL);
            };
          if (moment == "before the exposure") cameras[1]->instead = fault;
          if (moment == "half of the file") cameras[1]->halfway = die_at;
          if (moment == "after the file") cameras[1]->afterwards = fault;
        };
        scene.run();
        _exit(0);
      }
      int status = 0;
      waitpid(child, &status, 0);
      ASSERT_TRUE(WIFSIGNALED(status));
      scene.who.answers[About::doubt] = {"again"};
      scene.run();
      scene.expect_complete();
      // In doubt is only what left neither a word nor a whole file.
      const bool doubt = !recalls && (moment == "before the exposure" || moment == "half of the file");
      EXPECT_EQ(scene.who.count(About::doubt), doubt ? 1u : 0u);
      EXPECT_EQ(scene.exposures("right").size(), doubt && moment == "half of the file" ? 7u : 6u);
      EXPECT_EQ(scene.exposures("left").size(), 6u);
    }
}

TEST(KilledCables, ACablesRobotGoesOnFromBetweenTwoStops) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::cable_plan(6, 3));
  for (PlannedStop& stop : scene.plan.stops) stop.travel_s = 0.02;
  scene.who.answers[About::position] = {scene.plan.stops[0].name};
  const Kills killed = run_killed(scene, 12, 0.3, 5);
  EXPECT_GT(killed.kills, 0);  // a fast machine is done before twelve
  scene.expect_complete();
  expect_planned_order(scene, "main");
}

}  // namespace
}  // namespace lumihull::capture
