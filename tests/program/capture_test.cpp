// lumihull capture: simulated devices through a plan; stopped, killed, gone on with; the firmware as the robot.
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>

#include <filesystem>
#include <nlohmann/json.hpp>

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
  EXPECT_THAT(with("levitation", "simulate").err, HasSubstr("expected simulate, turntable, hand or serial:PORT"));
  EXPECT_THAT(with("simulate", "eye").err, HasSubstr("expected simulate, hand, serial"));
  EXPECT_THAT(with("simulate", "serial").err, HasSubstr("has no serial port"));
  EXPECT_THAT(with("simulate", "folder:" + mine("nowhere")).err, HasSubstr("nowhere"));
  const auto unplugged = with("serial:" + mine("tty"), "serial");
  EXPECT_EQ(unplugged.status, 1);
  EXPECT_THAT(unplugged.err, HasSubstr("tty"));
  const auto no_plan = lumihull({"capture", mine("new"), "--robot", "simulate", "--camera", "simulate"});
  EXPECT_EQ(no_plan.status, 2);
  EXPECT_THAT(no_plan.err, HasSubstr("--plan"));
}

}  // namespace
}  // namespace lumihull
