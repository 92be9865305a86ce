// Sessions with the firmware as robot and camera, whose port is pulled out, or whose line is cut, in the middle.

#include <lumihull/base/files.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/session.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "serial_simulator.h"
#include "session_scene.h"

namespace lumihull::test {
namespace {

using namespace capture;
using About = Question::About;
using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

constexpr double kSpeed = 10;

/// A capture whose controller is another one after each time that it was plugged in.
struct SerialScene {
  TemporaryFolder place;
  std::filesystem::path folder = place / "object";
  Plan plan = short_hops();
  SessionOptions options;
  ScriptedOperator who;

  SerialScene() {
    options.settle_s = 0;
    for (PlannedStop& stop : plan.stops)
      stop.exposure_s = 2;  // of the simulator's: long enough to be met in the middle
  }

  SessionResult run(const SerialSimulator& simulator) {
    const auto link = open_serial_link({.device = simulator.device(), .time_scale = kSpeed});
    const auto robot = open_serial_robot(link, *plan.mechanism);
    const auto camera = open_serial_camera(link);
    CameraDevice* cameras[] = {camera.get()};
    Job job;
    return capture::capture(plan, *robot, cameras, folder, options, who, job);
  }
  JournalState journal() const { return read_journal(journal_path(folder)); }

  /// Every view was taken, in the plan's order, and no shot number twice by any of the controllers.
  void expect_complete(const std::vector<std::vector<SimulatedEvent>>& logs) const {
    const JournalState state = journal();
    ShotId last = 0;
    for (std::size_t i = 0; i < state.shots.size(); ++i) {
      SCOPED_TRACE(plan.stops[i].name);
      EXPECT_EQ(state.shots[i].step, ShotStep::done);
      const ShotId shot = state.shots[i].take.shot;
      EXPECT_GT(shot, last);
      last = shot;
      unsigned begun = 0, whole = 0;
      for (const auto& log : logs) {
        const TrueShot there = true_shots(log, state.last_id + 1)[shot];
        begun += there.begun, whole += there.whole;
      }
      EXPECT_EQ(begun, 1u);
      EXPECT_EQ(whole, 1u);
    }
  }
};

/// Waits for the nth such event, then does it to the simulator.
template <class Deed>
std::thread at(const SerialSimulator& simulator, const std::string& event, int n, Deed deed) {
  return std::thread([&simulator, event, n, deed] {
    std::size_t from = 0;
    for (int i = 0; i < n; ++i) from = simulator.await(event, from) + 1;
    deed();
  });
}

Error ended_by(SerialScene& scene, const SerialSimulator& simulator) {
  const auto start = Clock::now();
  const Error e = expect_error([&] { scene.run(simulator); });
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(60));  // bounded, not fast
  EXPECT_EQ(e.code(), ErrorCode::io) << e.what();
  EXPECT_EQ(scene.journal().last, EventKind::fault);
  EXPECT_THAT(read_file(scene.folder / "contact.html"), HasSubstr("stopped by a fault"));
  return e;
}

TEST(SerialSession, APortPulledOutWhileThePlatformMoves) {
  SerialScene scene;
  SerialSimulator first({"--speed", "10"});
  std::thread hand = at(first, "moves", 3, [&] { first.kill(); });
  const Error e = ended_by(scene, first);
  hand.join();
  EXPECT_THAT(e.what(), HasSubstr(first.device()));
  EXPECT_THAT(e.what(), HasSubstr("plug the controller in again"));
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
  // Not plugged in yet: a clear word, and nothing is changed.
  const std::string before = read_file(journal_path(scene.folder));
  EXPECT_EQ(expect_error([&] { scene.run(first); }).code(), ErrorCode::not_found);
  EXPECT_EQ(read_file(journal_path(scene.folder)), before);
  // Plugged in again it has forgotten where the platform is: the operator says so, and it goes on.
  const SerialSimulator second({"--speed", "10"});
  const std::size_t positions = scene.who.count(About::position);
  EXPECT_EQ(scene.run(second).awaited, scene.plan.stops.size());
  EXPECT_EQ(scene.who.count(About::position), positions + 1);
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
  scene.expect_complete({first.log(), second.log()});
}

TEST(SerialSession, APortPulledOutWhileItSettlesLeavesNoDoubt) {
  SerialScene scene;
  SerialSimulator first({"--speed", "10"});
  int stops = 0;
  scene.options.retry_after_s = 0;
  scene.options.settle = [&](double, Job&) {
    if (++stops == 3) first.kill();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // a hang-up is heard at once, but by another thread
  };
  const Error e = ended_by(scene, first);
  EXPECT_THAT(e.what(), HasSubstr("plug the controller in again"));
  EXPECT_THAT(e.what(), HasSubstr(first.device()));
  const SerialSimulator second({"--speed", "10"});
  EXPECT_EQ(scene.run(second).awaited, scene.plan.stops.size());
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
  scene.expect_complete({first.log(), second.log()});
}

TEST(SerialSession, APortPulledOutWhileTheShutterIsOpen) {
  SerialScene scene;
  SerialSimulator first({"--speed", "10"});
  std::thread hand = at(first, "shutter on 3", 1, [&] { first.kill(); });
  const Error e = ended_by(scene, first);
  hand.join();
  EXPECT_THAT(e.what(), HasSubstr("plug the controller in again"));
  // Whether the third was taken nobody can tell but a person.
  const SerialSimulator second({"--speed", "10"});
  scene.who.answers[About::doubt] = {"again"};
  EXPECT_EQ(scene.run(second).awaited, scene.plan.stops.size());
  EXPECT_EQ(scene.who.count(About::doubt), 1u);
  EXPECT_EQ(scene.journal().shots[2].take.shot, 4u) << "a number of its own";
  scene.expect_complete({first.log(), second.log()});
}

TEST(SerialSession, ALineThatIsCutAndMended) {
  SerialScene scene;
  const SerialSimulator simulator({"--speed", "10"});
  std::thread hand = at(simulator, "moves", 3, [&] { simulator.order("deaf on"); });
  const Error e = ended_by(scene, simulator);
  hand.join();
  EXPECT_THAT(e.what(), HasSubstr("answer"));
  // The controller stopped its winches by itself, and still knows where the platform is.
  simulator.await("rests", simulator.await("deaf on"));
  simulator.order("deaf off");
  simulator.await("deaf off");
  const std::size_t positions = scene.who.count(About::position);
  EXPECT_EQ(scene.run(simulator).awaited, scene.plan.stops.size());
  EXPECT_EQ(scene.who.count(About::position), positions);
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
  scene.expect_complete({simulator.log()});
}

}  // namespace
}  // namespace lumihull::test
