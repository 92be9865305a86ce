// lumihull capture: simulated devices through a plan; stopped, killed, gone on with; the firmware as the robot.
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/serial.h>
#include <lumihull/capture/session.h>
#include <lumihull/rig/rig_camera.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "../capture/serial_simulator.h"
#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using test::lumihull;
using testing::HasSubstr;

class CaptureVerb : public testing::Test {
 protected:
  void SetUp() override {
    const auto run = lumihull({"plan", "--object-diameter", "0.6", "--radius", "1.5", "--steps", "6x3", "--kicks", "10",
                               "--quiet", "--json", "-o", mine("plan.json")});
    ASSERT_EQ(run.status, 0) << run.err;
    photographs_ = nlohmann::json::parse(run.out)["photographs"];
    ASSERT_GT(photographs_, 10u);
  }
  std::string mine(const std::string& name) const { return (mine_ / name).string(); }
  test::Outcome capture(std::vector<std::string> more, const test::ProcessOptions& options = {}) const {
    std::vector<std::string> words{"capture",  mine("cap"), "--plan",   mine("plan.json"),
                                   "--robot",  "simulate",  "--camera", "simulate",
                                   "--settle", "0",         "--quiet",  "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return lumihull(words, options);
  }
  std::size_t files() const {
    std::size_t n = 0;
    for (const auto& entry : std::filesystem::directory_iterator(mine("cap/photos"))) n += entry.is_regular_file();
    return n;
  }

  test::TemporaryFolder mine_;
  std::size_t photographs_ = 0;
};

TEST_F(CaptureVerb, PausesAndGoesOn) {
  const auto dry = capture({"--dry-run"});
  ASSERT_EQ(dry.status, 0) << dry.err;
  EXPECT_EQ(nlohmann::json::parse(dry.out)["left"], photographs_);
  EXPECT_FALSE(std::filesystem::exists(mine("cap/photos")));

  const auto refused = capture({});  // nobody is there to agree that the robot moves
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.err, HasSubstr("Is the way free?"));

  const auto first = capture({"--yes", "--pause-after", "4"});
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_EQ(nlohmann::json::parse(first.out)["taken"], 4);
  EXPECT_EQ(nlohmann::json::parse(first.out)["paused"], true);
  EXPECT_EQ(files(), 4u);

  const auto second = capture({"--yes"});
  ASSERT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(nlohmann::json::parse(second.out)["views"], photographs_);
  EXPECT_EQ(nlohmann::json::parse(second.out)["taken"], photographs_ - 4);
  EXPECT_EQ(files(), photographs_);

  // What was taken is a capture like any other.
  const Capture made = Capture::open(mine("cap"));
  EXPECT_EQ(made.shots.size(), photographs_);
  for (const Shot& shot : made.shots) {
    EXPECT_EQ(sha256_of_file(made.photo_path(shot)), shot.stamp.sha256) << shot.name;
    EXPECT_FALSE(shot.cam_from_world) << "a commanded pose is none that was measured";
  }
  EXPECT_TRUE(std::filesystem::exists(mine("cap/contact.html")));
  EXPECT_EQ(lumihull({"info", mine("cap")}).status, 0);
}

TEST_F(CaptureVerb, GoesOnAfterAKill) {
  std::size_t kills = 0;
  for (int run = 0; run < 40; ++run) {
    const auto outcome = capture({"--yes"}, {.kill_after_s = .15 + .05 * run});
    if (outcome.status == 0) break;
    // Where the kill fell between release and answer the simulated camera tells; nobody needs to be asked.
    ASSERT_EQ(outcome.status, 128 + 9) << outcome.err;
    ++kills;
  }
  EXPECT_GT(kills, 0u);
  EXPECT_EQ(files(), photographs_);
}

TEST_F(CaptureVerb, WrongWordsAreErrors) {
  const auto with = [&](const std::string& robot, const std::string& camera) {
    return lumihull({"capture", mine("cap"), "--plan", mine("plan.json"), "--robot", robot, "--camera", camera, "--yes",
                     "--quiet"});
  };
  EXPECT_THAT(with("levitation", "simulate").err,
              HasSubstr("expected one of simulate, turntable, hand, serial:PORT, rig"));
  EXPECT_THAT(with("simulate", "eye").err, HasSubstr("folder:DIR, rig[:OBJECT[:WIDTH]]"));
  EXPECT_THAT(with("simulate", "serial").err, HasSubstr("has no serial port"));
  EXPECT_THAT(with("simulate", "rig").err, HasSubstr("--robot rig"));
  EXPECT_THAT(with("rig:vase", "rig").err, HasSubstr("the camera's word"));
  EXPECT_THAT(with("rig", "rig:dragon").err, HasSubstr("dragon"));
  EXPECT_THAT(with("rig", "rig:vase:3").err, HasSubstr("width"));
  EXPECT_THAT(with("simulate", "folder:" + mine("nowhere")).err, HasSubstr("nowhere"));
  const auto no_time = capture({"--yes", "--exposure", "0"});
  EXPECT_EQ(no_time.status, 2);
  EXPECT_THAT(no_time.err, HasSubstr("--exposure"));
  const auto unplugged = with("serial:" + mine("tty"), "serial");
  EXPECT_EQ(unplugged.status, 1);
  EXPECT_THAT(unplugged.err, HasSubstr("tty"));
  const auto no_plan = lumihull({"capture", mine("new"), "--robot", "simulate", "--camera", "simulate"});
  EXPECT_EQ(no_plan.status, 2);
  EXPECT_THAT(no_plan.err, HasSubstr("--plan"));
}

/// Rehearsed with pictures: killed, gone on with, a stop taken once more, and calibrated by the sheets in them.
TEST_F(CaptureVerb, RehearsesWithTheVirtualRig) {
  const auto planned = lumihull({"plan", "--object-diameter", "0.4", "--radius", "1.5", "--steps", "8x1", "--phi",
                                 "60..60", "--kicks", "10", "--quiet", "--json", "-o", mine("ring.json")});
  ASSERT_EQ(planned.status, 0) << planned.err;
  ASSERT_EQ(nlohmann::json::parse(planned.out)["photographs"], 8);
  const auto rig = [&](const std::string& camera, std::vector<std::string> more, double kill_after_s = 0) {
    std::vector<std::string> words{"capture", mine("cap"), "--plan", mine("ring.json"), "--robot",
                                   "rig",     "--camera",  camera,   "--quiet",         "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return lumihull(words, {.kill_after_s = kill_after_s});
  };
  const auto dry = rig("rig:box:1000", {"--dry-run"});
  ASSERT_EQ(dry.status, 0) << dry.err;
  EXPECT_EQ(nlohmann::json::parse(dry.out)["left"], 8);
  EXPECT_FALSE(std::filesystem::exists(mine("cap")));

  std::size_t kills = 0;
  test::Outcome outcome;
  for (int run = 0; run < 40; ++run) {
    outcome = rig("rig:box:1000", {"--yes"}, 1 + .5 * run);
    if (outcome.status != 128 + 9) break;
    ++kills;
  }
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_GT(kills, 0u);
  EXPECT_EQ(files(), 8u);
  const std::string stop = capture::read_plan(mine("ring.json")).stops.back().name;
  const auto retaken = rig("rig:box:1000", {"--yes", "--retake", stop});
  ASSERT_EQ(retaken.status, 0) << retaken.err;
  EXPECT_EQ(files(), 9u);

  const Capture made = Capture::open(mine("cap"));
  ASSERT_EQ(made.shots.size(), 8u);
  EXPECT_THAT(made.shots.back().file, HasSubstr(stop + "-camera~2.jpg"));
  for (const Shot& shot : made.shots) EXPECT_EQ(sha256_of_file(made.photo_path(shot)), shot.stamp.sha256) << shot.name;
  const auto calibrated = lumihull({"calibrate", mine("cap"), "--targets", mine("cap/sheets.json"), "--quiet"});
  ASSERT_EQ(calibrated.status, 0) << calibrated.err;
  const Capture placed = Capture::open(mine("cap"));
  std::vector<Eigen::Vector3d> found, real;
  for (const Shot& shot : placed.shots) {
    ASSERT_TRUE(shot.cam_from_world) << shot.name;
    const auto truth = rig::read_exposure(mine("cap/truth"), shot.commanded->id);
    ASSERT_TRUE(truth) << shot.name;
    EXPECT_EQ(truth->sha256, shot.stamp.sha256);
    found.push_back(shot.cam_from_world->center());
    real.push_back(truth->cam_from_world.center());
  }
  for (std::size_t i = 1; i < real.size(); ++i)
    EXPECT_NEAR((found[i] - found[0]).norm(), (real[i] - real[0]).norm(), .005) << placed.shots[i].name;

  EXPECT_THAT(rig("rig:vase:1000", {"--yes"}).err, HasSubstr("another object"));
}

TEST_F(CaptureVerb, DrivesTheFirmwareAndGoesOnAfterKills) {
  const test::SerialSimulator simulator({"--speed", "2"});
  const capture::Plan plan = test::short_hops();
  capture::write_plan(plan, mine("hops.json"));
  const auto run = [&](std::vector<std::string> more, double kill_after_s) {
    std::vector<std::string> words{
        "capture",  mine("hops"), "--plan",  mine("hops.json"), "--robot", "serial:" + simulator.device(),
        "--camera", "serial",     "--quiet", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return lumihull(words, {.kill_after_s = kill_after_s});
  };
  const auto lost = run({"--yes"}, 0);  // a controller that was just switched on does not know where the platform is
  EXPECT_NE(lost.status, 0);
  EXPECT_THAT(lost.err, HasSubstr("position"));
  {
    const auto robot =
        capture::open_serial_robot(capture::open_serial_link({.device = simulator.device()}), *plan.mechanism);
    robot->declare_position(plan.stops.front());
  }
  std::size_t kills = 0;
  test::Outcome outcome;
  for (; kills < 12; ++kills) {
    outcome = run({"--yes"}, .7 + .35 * double(kills));
    if (outcome.status != 128 + 9) break;
  }
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_GT(kills, 0u);
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["views"], 0);
  EXPECT_EQ(result["awaited"], plan.stops.size()) << "its files are on the camera's card";
  // What the controller did: each exposure once, for its time.
  const capture::JournalState journal = capture::read_journal(capture::journal_path(mine("hops")));
  const auto shots = test::true_shots(simulator.log(), journal.last_id + 1);
  std::size_t begun = 0;
  for (const test::TrueShot& shot : shots) {
    EXPECT_LE(shot.begun, 1u);
    begun += shot.begun;
  }
  EXPECT_EQ(begun, plan.stops.size());
  for (const capture::ShotProgress& shot : journal.shots) {
    EXPECT_EQ(shot.step, capture::ShotStep::done);
    EXPECT_TRUE(shots[shot.take.shot].whole) << shot.take.shot;
    EXPECT_EQ(shots[shot.take.shot].ms, 50u);
  }
}

}  // namespace
}  // namespace lumihull
