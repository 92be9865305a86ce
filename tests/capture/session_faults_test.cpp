#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using About = Question::About;
using testing::HasSubstr;

ShotOutcome outcome(ShotState state, const std::string& detail) { return {state, {}, detail}; }

TEST(SessionFaults, ADryRunTellsAllThatIsWrongAndTouchesNothing) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.options.names = "{stop}{colour}";
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("{number}"));
  scene.options.names = "{camera}";
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("a001-e00"));
  for (const char* names : {"../{stop}", ".{stop}", "{stop}~2", "{stop}/x"}) {
    scene.options.names = names;
    EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::bad_input) << names;
  }
  scene.options.names = "{stop}";
  scene.plan.stops[1].name = scene.plan.stops[0].name;
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::bad_input);
  EXPECT_FALSE(fs::exists(scene.folder));
  EXPECT_TRUE(scene.moves.empty());
  EXPECT_TRUE(scene.ended_safe);
}

TEST(SessionFaults, ACrossingWayIsFoundBeforeAnythingMoves) {
  const test::TemporaryFolder folder;
  Plan plan = test::cable_plan(4, 2);
  plan.object = KeepOut{{0, 0, -2}, 2.5, 4};  // larger than the hemisphere
  test::Scene scene(folder.path(), plan);
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::bad_input);
  EXPECT_TRUE(scene.moves.empty());
  EXPECT_FALSE(fs::exists(scene.folder));
}

TEST(SessionFaults, ARefusedShotIsAskedForAgainUnderItsNumber) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  int refusals = 0;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->instead = [&](ShotId id) -> std::optional<ShotOutcome> {
      if (id == 2 && refusals < 2) return ++refusals, outcome(ShotState::refused, "the lens can't focus");
      return std::nullopt;
    };
  };
  scene.run();
  scene.expect_complete();
  EXPECT_EQ(Capture::open(scene.folder).shots[1].commanded->attempts, 3);
  EXPECT_EQ(scene.exposures("main").size(), 3u);
}

TEST(SessionFaults, ADeadCameraStopsTheSessionSafely) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(5));
  bool dead = true, thrown = false;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->instead = [&](ShotId id) -> std::optional<ShotOutcome> {
      if (dead && id >= 3 && thrown) throw Error(ErrorCode::io, "the camera is gone", "usb:1");
      if (dead && id >= 3) return outcome(ShotState::refused, "battery empty");
      return std::nullopt;
    };
  };
  Error e = test::expect_error([&] { scene.run(); });
  EXPECT_EQ(e.code(), ErrorCode::io);
  EXPECT_THAT(e.what(), HasSubstr("a002-e00"));
  EXPECT_THAT(e.what(), HasSubstr("battery empty"));
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(scene.state().last, EventKind::fault);
  EXPECT_EQ(Capture::open(scene.folder).shots.size(), 2u);
  EXPECT_THAT(read_file(scene.folder / "contact.html"), HasSubstr("battery empty"));
  thrown = true;
  e = test::expect_error([&] { scene.run(); });
  EXPECT_THAT(e.what(), HasSubstr("usb:1: the camera is gone"));
  EXPECT_TRUE(scene.ended_safe);
  dead = false;
  scene.run();
  scene.expect_complete();
}

TEST(SessionFaults, AnUnpluggedPortStopsTheSessionSafely) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(5));
  bool unplugged = true;
  scene.prepare = [&](capture::SimulatedRobot& robot, auto&) {
    robot.on_move = [&](const PlannedStop& stop) {
      if (unplugged && stop.name == "a003-e00") throw Error(ErrorCode::io, "the port is gone", "/dev/ttyUSB0");
    };
  };
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).what(), HasSubstr("/dev/ttyUSB0"));
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(scene.state().views(), 3u);
  unplugged = false;
  scene.run();
  scene.expect_complete();
}

TEST(SessionFaults, ADoubtIsDecidedByTheOperatorAlone) {
  const test::TemporaryFolder folder;
  for (const bool exposed : {false, true})
    for (const std::string answer : {"again", "taken", "stop"}) {
      SCOPED_TRACE(answer + (exposed ? " exposed" : " not exposed"));
      test::Scene scene(folder / (answer + std::to_string(exposed)), test::turntable_plan(4));
      scene.recalls = false;
      bool lost = true;
      const auto fault = [&](ShotId id) -> std::optional<ShotOutcome> {
        if (id != 2 || !lost) return std::nullopt;
        fs::remove_all(scene.folder / "incoming" / "2");  // nothing of it came
        return outcome(ShotState::unknown, "no answer");
      };
      scene.prepare = [&](auto&, auto& cameras) { (exposed ? cameras[0]->afterwards : cameras[0]->instead) = fault; };
      scene.who.answers[About::doubt] = {answer};
      if (answer == "stop") {
        EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::cancelled);
        EXPECT_EQ(scene.state().count(ShotStep::unknown), 1u);
        lost = false;
        scene.who.answers[About::doubt] = {"again"};
        scene.run();  // asked again, for it is still in doubt
        EXPECT_EQ(scene.who.count(About::doubt), 2u);
        scene.expect_complete();
        continue;
      }
      scene.run();
      EXPECT_EQ(scene.who.count(About::doubt), 1u);
      EXPECT_THAT(scene.who.asked[1].text, HasSubstr("a001-e00"));
      if (answer == "again") {
        scene.expect_complete();
        EXPECT_EQ(scene.state().shots[1].take.shot, 3u);  // a new number
        EXPECT_EQ(scene.exposures("main").size(), exposed ? 5u : 4u);
      } else {
        EXPECT_EQ(scene.state().shots[1].step, ShotStep::done);
        EXPECT_TRUE(scene.state().shots[1].take.confirmed);
        EXPECT_EQ(scene.run().taken, 0u);  // and is not asked for again
        EXPECT_EQ(scene.who.count(About::doubt), 1u);
      }
    }
}

TEST(SessionFaults, WithoutAnOperatorADoubtStopsWithAClearWord) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  const Plan plan = scene.plan;
  capture::SimulatedRobot robot({.time_scale = 1, .memory = {}});
  capture::SimulatedCamera camera({.list = folder / "list", .recalls = false, .card = {}}, &robot);
  camera.instead = [](ShotId) { return outcome(ShotState::unknown, "the link broke"); };
  CameraDevice* cameras[] = {&camera};
  Job job;
  AbsentOperator nobody(true), shy(false);
  Error e = test::expect_error([&] { capture::capture(plan, robot, cameras, scene.folder, {}, shy, job); });
  EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
  EXPECT_THAT(e.message(), HasSubstr("Is the way free"));
  e = test::expect_error([&] { capture::capture(plan, robot, cameras, scene.folder, {}, nobody, job); });
  EXPECT_EQ(e.code(), ErrorCode::invalid_argument);
  EXPECT_THAT(e.message(), HasSubstr("the link broke"));
}

TEST(SessionFaults, AWholeFileThatArrivedEndsTheDoubt) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.recalls = false;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->afterwards = [](ShotId id) -> std::optional<ShotOutcome> {
      if (id == 2) return outcome(ShotState::unknown, "no answer");
      return std::nullopt;
    };
  };
  scene.run();
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
  scene.expect_complete();
}

TEST(SessionFaults, ACameraThatNeverDeliversIsNoticed) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.recalls = false;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->afterwards = [&](ShotId id) -> std::optional<ShotOutcome> {
      fs::remove_all(scene.folder / "incoming" / std::to_string(id));
      return outcome(ShotState::done, "time-out");
    };
  };
  scene.who.answers[About::doubt] = {"stop"};
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::cancelled);
  EXPECT_THAT(scene.who.asked.back().text, HasSubstr("its file did not come: time-out"));
  EXPECT_EQ(scene.exposures("main").size(), 1u);
  scene.who.answers[About::doubt] = {"taken"};
  EXPECT_EQ(scene.run().awaited, 3u);
  EXPECT_EQ(scene.exposures("main").size(), 3u);
}

TEST(SessionFaults, ADamagedDownloadIsNotTaken) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.recalls = false;
  bool damaged = true;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->afterwards = [&](ShotId id) -> std::optional<ShotOutcome> {
      if (id != 2 || !damaged) return std::nullopt;
      const fs::path file = scene.folder / "incoming" / "2" / "IMG_2.jpg";
      fs::resize_file(file, fs::file_size(file) / 2);
      return ShotOutcome{ShotState::done, file, ""};
    };
  };
  scene.who.answers[About::doubt] = {"again"};
  scene.run();
  EXPECT_EQ(scene.who.count(About::doubt), 1u);
  EXPECT_THAT(scene.who.asked.back().text, HasSubstr("damaged or truncated"));
  scene.expect_complete();
}

TEST(SessionFaults, FilesInTheWayAreNeverReplaced) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  fs::create_directories(scene.folder / "photos");
  write_file(scene.folder / "photos" / "a001-e00-main.jpg", "mine");
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("a001-e00-main.jpg"));
  EXPECT_TRUE(scene.moves.empty());
  fs::remove(scene.folder / "photos" / "a001-e00-main.jpg");
  // One that appears while the capture goes on.
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->afterwards = [&](ShotId id) -> std::optional<ShotOutcome> {
      if (id == 2) write_file(scene.folder / "photos" / "a001-e00-main.jpg", "mine");
      return std::nullopt;
    };
  };
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("in the way"));
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(read_file(scene.folder / "photos" / "a001-e00-main.jpg"), "mine");
  fs::rename(scene.folder / "photos" / "a001-e00-main.jpg", folder / "mine");
  scene.prepare = {};
  scene.run();
  scene.expect_complete();
  EXPECT_EQ(scene.exposures("main").size(), 3u);
}

TEST(SessionFaults, APhotographThatVanishedIsAskedAbout) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.run();
  fs::remove(scene.folder / "photos" / "a001-e00-main.jpg");
  scene.who.answers[About::doubt] = {"stop"};
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::cancelled);
  scene.who.answers[About::doubt] = {"again"};
  EXPECT_EQ(scene.run().taken, 1u);
  EXPECT_TRUE(fs::exists(scene.folder / "photos" / "a001-e00-main~2.jpg"));
}

TEST(SessionFaults, AFullDiskStopsSafelyAndTheSessionGoesOn) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(6));
  scene.options.least_free_bytes = std::uint64_t(1) << 60;
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("MB are asked for"));
  EXPECT_TRUE(scene.moves.empty());
  scene.options.least_free_bytes = 0;
  // A file may grow to so much and no more: the journal first, later photographs.
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  std::size_t failed = 0;
  for (rlim_t limit = 600; limit < 12000; limit += 150) {
    const rlimit tight{limit, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &tight);
    try {
      scene.run();
    } catch (const Error& e) {
      EXPECT_THAT(e.code(), testing::AnyOf(ErrorCode::io, ErrorCode::cancelled)) << e.what();
      ++failed;
    }
    setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_TRUE(scene.ended_safe);
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_GT(failed, 10u);
  scene.run();
  scene.expect_complete();
}

TEST(SessionFaults, AReadOnlyFolderIsToldBeforeAnythingMoves) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  fs::create_directories(scene.folder);
  fs::permissions(folder.path(), fs::perms::all, fs::perm_options::add);
  fs::permissions(scene.folder, fs::perms(0555));
  const bool root = geteuid() == 0;
  if (root && seteuid(65534) != 0) GTEST_SKIP() << "root may write anywhere, and can't leave its rights";
  const Error e = test::expect_error([&] { scene.run(); });
  if (root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_THAT(e.message(), HasSubstr("can't be written"));
  EXPECT_TRUE(scene.moves.empty());
  fs::permissions(scene.folder, fs::perms::owner_all);
}

TEST(SessionFaults, ADamagedJournalIsRefused) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(5));
  scene.options.pause_after = 3;
  scene.run();
  std::string text = read_file(journal_path(scene.folder));
  const std::size_t at = text.find("\"firing\"");
  text[at + 1] = 'F';
  std::ofstream(journal_path(scene.folder), std::ios::binary) << text;
  const Error e = test::expect_error([&] { scene.run(); });
  EXPECT_EQ(e.code(), ErrorCode::bad_input);
  EXPECT_THAT(e.what(), HasSubstr("journal.jsonl line "));
  EXPECT_EQ(scene.exposures("main").size(), 3u);
}

TEST(SessionFaults, AnotherPlanIsRefused) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(5));
  scene.options.pause_after = 2;
  scene.run();
  const Plan good = scene.plan;
  scene.plan.stops[4].theta_rad += 1e-9;
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("another plan"));
  scene.plan = good;
  std::string stored = read_file(plan_path(scene.folder));
  write_file(plan_path(scene.folder), stored + " ");
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("was changed"));
  write_file(plan_path(scene.folder), stored);
  scene.options.pause_after = 0;
  scene.run();
  scene.expect_complete();
}

TEST(SessionFaults, OneProcessAtATime) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  std::optional<Error> second;
  scene.prepare = [&](capture::SimulatedRobot& robot, auto&) {
    robot.on_move = [&](const PlannedStop& stop) {
      if (stop.name != "a001-e00") return;
      test::Scene other(folder.path(), test::turntable_plan(3));
      second = test::expect_error([&] { other.run(); });
      EXPECT_TRUE(other.moves.empty());
    };
  };
  scene.run();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->code(), ErrorCode::io);
  EXPECT_THAT(second->message(), HasSubstr("another process"));
  scene.expect_complete();
}

TEST(SessionFaults, AForeignCaptureIsLeftAlone) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  Capture::create(scene.folder).save();
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("not begun by"));
}

TEST(SessionFaults, AnExposureOfNoTimeIsRefusedBeforeAnythingMoves) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  for (const double exposure_s : {0., -1., 3601.}) {
    scene.options.exposure_s = exposure_s;
    const Error error = test::expect_error([&] { scene.run(); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_THAT(error.message(), HasSubstr("exposure: expected above 0"));
    EXPECT_TRUE(scene.exposures("main").empty());
  }
  scene.options.exposure_s = .002;
  scene.run();
  scene.expect_complete();
}

TEST(SessionFaults, CancelledWhileSettlingAndWhileExposing) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(4));
  Job job;
  scene.options.settle_s = 3000;
  scene.prepare = [&](capture::SimulatedRobot& robot, auto&) { robot.on_roll = [&](double) { job.cancel(); }; };
  EXPECT_EQ(test::expect_error([&] { scene.run(&job); }).code(), ErrorCode::cancelled);
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(scene.state().last, EventKind::stopped);
  EXPECT_TRUE(scene.exposures("main").empty());
  scene.options.settle_s.reset();
  Job second;
  scene.prepare = [&](auto&, auto& cameras) {
    cameras[0]->instead = [&](ShotId id) -> std::optional<ShotOutcome> {
      if (id == 2) second.cancel();
      return std::nullopt;
    };
  };
  EXPECT_EQ(test::expect_error([&] { scene.run(&second); }).code(), ErrorCode::cancelled);
  EXPECT_EQ(scene.state().views(), 2u);  // the exposure under way was waited for
  EXPECT_EQ(scene.state().count(ShotStep::unknown) + scene.state().count(ShotStep::firing), 0u);
  scene.prepare = {};
  scene.run();
  scene.expect_complete();
  EXPECT_EQ(scene.who.count(About::doubt), 0u);
}

TEST(SessionFaults, AMoveOfAKilledSessionIsStoppedFirst) {
  /// On its way until it is told to stop, which takes three looks.
  struct OnItsWay : SimulatedRobot {
    using SimulatedRobot::SimulatedRobot;
    State state() override {
      State now = SimulatedRobot::state();
      now.moving = !stopped || looks-- > 0;
      return now;
    }
    void make_safe() noexcept override {
      stopped = true;
      SimulatedRobot::make_safe();
    }
    void move_to(const PlannedStop& stop, Job& job) override {
      EXPECT_TRUE(stopped && looks < 0);
      SimulatedRobot::move_to(stop, job);
    }
    bool stopped = false;
    int looks = 3;
  };
  const test::TemporaryFolder folder;
  OnItsWay robot({.time_scale = 1, .memory = {}});
  SimulatedCamera camera({.list = folder / "list", .card = {}}, &robot);
  CameraDevice* cameras[] = {&camera};
  test::ScriptedOperator who;
  Job job;
  const Plan plan = test::turntable_plan(2);
  EXPECT_EQ(capture::capture(plan, robot, cameras, folder / "c", {}, who, job).views, 2u);
  EXPECT_THAT(who.told, testing::Contains(HasSubstr("it was stopped")));
  // One that does not stop is a problem.
  OnItsWay runaway({.time_scale = 1, .memory = {}});
  runaway.looks = 1'000'000;
  const std::string why =
      test::expect_error([&] { capture::capture(plan, runaway, cameras, folder / "d", {}, who, job); }).message();
  EXPECT_THAT(why, HasSubstr("is moving"));
}

}  // namespace
}  // namespace lumihull::capture
