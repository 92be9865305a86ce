// Devices by their words.
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/devices.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/session.h>

#include <filesystem>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

using testing::HasSubstr;

TEST(Devices, KnowTheirWords) {
  for (const char* word : {"simulate", "turntable", "hand", "serial:/dev/ttyUSB0", "serial:a:b"})
    EXPECT_NO_THROW(check_robot_word(word)) << word;
  for (const char* word : {"", "robot", "serial", "serial:", "hand:left", "simulate:", "gphoto2", "Serial:/dev/tty"})
    EXPECT_EQ(test::expect_error([&] { check_robot_word(word); }).code(), ErrorCode::invalid_argument) << word;
  for (const char* word :
       {"simulate", "hand", "serial", "serial:/dev/ttyUSB0", "gphoto2", "gphoto2:ptpip:1.2.3.4", "folder:/tmp/a b"})
    EXPECT_NO_THROW(check_camera_word(word)) << word;
  for (const char* word : {"", "folder", "folder:", "gphoto2:", "serial:", "turntable", "simulate:x"})
    EXPECT_EQ(test::expect_error([&] { check_camera_word(word); }).code(), ErrorCode::invalid_argument) << word;
}

TEST(Devices, SimulatedOnesTakeACaptureAndRememberBesideIt) {
  const test::TemporaryFolder place;
  const std::filesystem::path folder = place / "c";
  const Plan plan = test::turntable_plan(5, {"left", "right"});
  Job job;
  for (const std::size_t pause : {3u, 0u}) {  // the second session goes on where the first one paused
    AbsentOperator nobody(true);
    Devices devices(folder, nobody);
    const auto robot = devices.robot("simulate", plan);
    const auto left = devices.camera("simulate", "left", *robot, job),
               right = devices.camera("simulate", "right", *robot, job);
    CameraDevice* cameras[] = {left.get(), right.get()};
    SessionOptions options;
    options.pause_after = pause;
    const SessionResult result = capture::capture(plan, *robot, cameras, folder, options, nobody, job);
    EXPECT_EQ(result.taken, pause ? 3u : 7u);
  }
  const Capture made = Capture::open(folder);
  ASSERT_EQ(made.shots.size(), 10u);
  for (const Shot& shot : made.shots) EXPECT_EQ(sha256_of_file(made.photo_path(shot)), shot.stamp.sha256);
  EXPECT_TRUE(std::filesystem::exists(place / "c.simulated/exposures-left"));
  EXPECT_TRUE(read_file(place / "c.simulated/robot").starts_with(plan.stops.back().name));
}

TEST(Devices, SayWhatIsMissing) {
  const test::TemporaryFolder place;
  test::ScriptedOperator who;
  Devices devices(place / "c", who);
  Job job;
  const Plan table = test::turntable_plan(2);
  const auto robot = devices.robot("simulate", table);
  const auto says = [](auto call) { return test::expect_error(call); };
  EXPECT_THAT(says([&] { devices.robot("serial:" + (place / "tty").string(), table); }).message(),
              HasSubstr("no mechanism"));
  EXPECT_EQ(says([&] { devices.robot("serial:" + (place / "tty").string(), test::cable_plan(3, 2)); }).code(),
            ErrorCode::not_found);
  const Error shared = says([&] { devices.camera("serial", "main", *robot, job); });
  EXPECT_THAT(shared.subject(), HasSubstr("tty")) << "the port of the robot that was asked for";
  Devices others(place / "d", who);
  EXPECT_THAT(says([&] { others.camera("serial", "main", *robot, job); }).message(), HasSubstr("no serial port"));
  EXPECT_EQ(says([&] { devices.camera("folder:" + (place / "none").string(), "main", *robot, job); }).code(),
            ErrorCode::not_found);
}

TEST(Devices, AProgramBringsItsOwn) {
  const test::TemporaryFolder place;
  test::ScriptedOperator who;
  Devices devices(place / "c", who);
  Job job;
  const Plan plan = test::turntable_plan(2);
  std::vector<std::string> whats;
  BroughtDevices own;
  own.robot_usage = "mine[:WHICH]", own.camera_usage = "mine";
  own.robot = [&](const std::string& what, const Plan&) {
    whats.push_back(what);
    return std::make_unique<SimulatedRobot>(SimulatedRobot::Options{.memory = {}});
  };
  own.camera = [&](const std::string& what, const std::string& name, const Robot&) -> std::unique_ptr<CameraDevice> {
    throw Error(ErrorCode::invalid_argument, "can't take " + name, what);
  };
  EXPECT_EQ(test::expect_error([&] { devices.robot("mine", plan); }).code(), ErrorCode::invalid_argument);
  devices.bring("mine", own);
  const auto robot = devices.robot("mine", plan);
  devices.robot("mine:left:2", plan);
  EXPECT_EQ(whats, (std::vector<std::string>{"", "left:2"}));
  EXPECT_THAT(test::expect_error([&] { devices.camera("mine:x", "main", *robot, job); }).message(),
              HasSubstr("can't take main"));
  for (const char* word : {"mine:", "yours"})
    EXPECT_THAT(test::expect_error([&] { devices.robot(word, plan); }).message(),
                HasSubstr("serial:PORT, mine[:WHICH]"));
  EXPECT_THAT(test::expect_error([&] { devices.camera("yours", "main", *robot, job); }).message(),
              HasSubstr("folder:DIR, mine"));
}

TEST(Devices, AFolderCamerasPictureIsAskedFor) {
  const test::TemporaryFolder place;
  std::filesystem::create_directories(place / "in");
  std::filesystem::create_directories(place / "out");
  /// Takes the photograph when it is told to.
  struct Person : test::ScriptedOperator {
    std::filesystem::path file;
    void tell(const std::string& line) override {
      ScriptedOperator::tell(line);
      write_jpeg(file, Image(32, 24, 3));
    }
  } who;
  who.file = place / "in/IMG_1.jpg";
  Devices devices(place / "c", who);
  Job job;
  const auto robot = devices.robot("hand", test::turntable_plan(1));
  const auto camera = devices.camera("folder:" + (place / "in").string(), "main", *robot, job);
  const ShotOutcome outcome = camera->shoot(7, 0.01, place / "out", job);
  EXPECT_EQ(outcome.state, ShotState::done) << outcome.detail;
  EXPECT_TRUE(std::filesystem::exists(outcome.file));
  ASSERT_EQ(who.told.size(), 1u);
  EXPECT_THAT(who.told[0], HasSubstr("shot 7"));
}

}  // namespace
}  // namespace lumihull::capture
