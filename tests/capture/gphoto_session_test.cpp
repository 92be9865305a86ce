// Sessions with a camera through libgphoto2 that loses events, hangs, is switched off, or whose helper dies: the
// capture goes on, or stops with a clear word, and goes on later.

#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/capture/camera_devices.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "ptpip_responder.h"
#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using test::PtpIpResponder;
using About = Question::About;
using Fault = PtpIpResponder::Fault;
using testing::HasSubstr;

/// The helper that libgphoto2 lives in.
pid_t helper() {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string line;
    if (!std::getline(stat, line)) continue;
    const auto behind = line.rfind(')');
    if (behind != std::string::npos && std::atoi(line.c_str() + behind + 4) == ::getpid())
      return pid_t(std::atoi(line.c_str()));
  }
  return 0;
}

void kill_helper() {
  const pid_t child = helper();
  ASSERT_GT(child, 0);  // 0 would be ourselves
  ::kill(child, SIGKILL);
}

class GphotoSession : public ::testing::Test {
 protected:
  void SetUp() override {
    std::error_code error;
    if (!fs::exists(LUMIHULL_GPHOTO_HELPER, error)) GTEST_SKIP() << "needs libgphoto2 (package libgphoto2-dev)";
  }

  SessionResult run() {
    Job job;
    SimulatedRobot robot({.time_scale = 1, .memory = place / "robot"});
    robot.on_move = on_move;
    GphotoOptions gphoto;
    gphoto.port = camera.gphoto_port();
    gphoto.model = "PTP/IP Camera";
    gphoto.event_timeout_s = gphoto.download_timeout_s = 1.5;
    const auto device = open_gphoto_camera(gphoto, job);
    CameraDevice* cameras[] = {device.get()};
    SessionOptions options;
    options.retry_after_s = 0;
    return capture::capture(plan, robot, cameras, folder, options, who, job);
  }

  /// Each view there once, the camera's own bytes, and as many exposures as are asked for.
  void expect_complete(int exposures) {
    EXPECT_EQ(camera.exposures(), exposures);
    std::map<std::string, int> taken;
    for (int i = 1; i <= exposures; ++i) taken[sha256(camera.picture(i))] = i;
    const JournalState state = read_journal(journal_path(folder));
    int last = 0;
    for (std::size_t i = 0; i < state.shots.size(); ++i) {
      SCOPED_TRACE(plan.stops[i].name);
      ASSERT_EQ(state.shots[i].step, ShotStep::landed);
      const Take& take = state.shots[i].landed.back();
      EXPECT_EQ(sha256_of_file(folder / "photos" / take.file), take.sha256);
      ASSERT_TRUE(taken.contains(take.sha256));
      EXPECT_GT(taken[take.sha256], last) << "the order is the plan's";
      last = taken[take.sha256];
    }
    EXPECT_EQ(std::size_t(std::distance(fs::directory_iterator(folder / "photos"), {})), plan.stops.size());
  }

  static std::string some_jpeg() {
    Image image(160, 120, 3);
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160 * 3; ++x) image.row<std::uint8_t>(y)[x] = std::uint8_t(x * y);
    return encode_jpeg(image, 90);
  }

  PtpIpResponder camera{some_jpeg()};
  const test::TemporaryFolder place;
  const fs::path folder = place / "object";
  const Plan plan = test::turntable_plan(5);
  std::function<void(const PlannedStop&)> on_move;
  /// Sees to the camera when a shot is in doubt, and has it taken again.
  struct Person : test::ScriptedOperator {
    PtpIpResponder* camera = nullptr;
    std::string ask(const Question& question, Job& job) override {
      if (question.about == About::doubt) camera->set_fault(Fault::none);
      return ScriptedOperator::ask(question, job);
    }
  } who;
};

TEST_F(GphotoSession, GoesOnAfterLostEventsHangsAndDeaths) {
  who.camera = &camera;
  on_move = [&](const PlannedStop& stop) {
    if (stop.name == "a001-e00") camera.set_fault(Fault::lose_both);
    if (stop.name == "a002-e00") camera.set_fault(Fault::die_in_capture);
    if (stop.name == "a003-e00") camera.set_fault(Fault::hang_in_capture);
  };
  EXPECT_EQ(run().views, 5u);
  EXPECT_EQ(who.count(About::doubt), 3u);
  for (const Question& question : who.asked)
    if (question.about == About::doubt) {
      EXPECT_THAT(question.text, HasSubstr("was taken is not known: "));
    }
  expect_complete(5 + 3);
}

TEST_F(GphotoSession, AHelperThatIsKilledBetweenShotsIsStartedAgain) {
  on_move = [&](const PlannedStop& stop) {
    if (stop.name == "a002-e00" || stop.name == "a004-e00") kill_helper();
  };
  EXPECT_EQ(run().views, 5u);
  EXPECT_EQ(who.count(About::doubt), 0u);
  expect_complete(5);
}

TEST_F(GphotoSession, AHelperThatIsKilledDuringAnExposureLeavesADoubt) {
  who.camera = &camera;
  on_move = [&](const PlannedStop& stop) {
    if (stop.name == "a002-e00") camera.set_fault(Fault::hang_in_capture);
  };
  std::thread hand([&] {
    while (camera.exposures() < 3) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill_helper();
  });
  EXPECT_EQ(run().views, 5u);
  hand.join();
  EXPECT_EQ(who.count(About::doubt), 1u);
  EXPECT_THAT(who.asked.back().text, HasSubstr("a002-e00"));
  expect_complete(5 + 1);
}

TEST_F(GphotoSession, ACameraThatIsSwitchedOffStopsItAndOnItGoesOn) {
  on_move = [&](const PlannedStop& stop) {
    if (stop.name != "a002-e00") return;
    kill_helper();
    camera.refuse_connections(true);
  };
  const Error e = test::expect_error([&] { run(); });
  EXPECT_EQ(e.code(), ErrorCode::io);
  EXPECT_THAT(e.what(), HasSubstr("camera"));
  EXPECT_EQ(read_journal(journal_path(folder)).views(), 2u);
  EXPECT_EQ(read_journal(journal_path(folder)).last, EventKind::fault);
  on_move = {};
  EXPECT_EQ(test::expect_error([&] { run(); }).code(), ErrorCode::io) << "still off";
  EXPECT_EQ(camera.exposures(), 2);
  camera.refuse_connections(false);
  EXPECT_EQ(run().views, 5u);
  EXPECT_EQ(who.count(About::doubt), 0u);
  expect_complete(5);
}

}  // namespace
}  // namespace lumihull::capture
