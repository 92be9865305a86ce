// lumihull plan: for cables, a turntable and a hand; and what goes wrong.
#include <lumihull/base/files.h>
#include <lumihull/capture/plan.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

using test::lumihull;
using testing::HasSubstr;

class PlanVerb : public testing::Test {
 protected:
  std::string mine(const std::string& name) const { return (mine_ / name).string(); }
  test::Outcome plan(std::vector<std::string> more, const std::string& diameter = "0.6") const {
    std::vector<std::string> words{"plan", "--object-diameter", diameter, "--quiet", "-o", mine("plan.json")};
    words.insert(words.end(), more.begin(), more.end());
    return lumihull(words);
  }
  test::TemporaryFolder mine_;
};

TEST_F(PlanVerb, PlansTheCables) {
  const auto run = plan(
      {"--radius", "1.5", "--steps", "12x6", "--scatter", "200", "--json", "--svg", mine("pictures"), "--kicks", "20"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  const capture::Plan plan = capture::read_plan(mine("plan.json"));
  EXPECT_EQ(plan.robot, "cables");
  EXPECT_EQ(json["stops"], plan.stops.size());
  EXPECT_EQ(json["photographs"].get<int>() + int(json["left_out"].size()), 72);
  EXPECT_NEAR(json["total_s"].get<double>(), capture::duration_s(plan), 1e-5);
  EXPECT_GE(json["least_tension_N"], 1);
  EXPECT_TRUE(json["cut_off"].empty());
  EXPECT_GT(json["median_targets"], 5);
  for (const char* picture : {"plan-above.svg", "plan-side.svg", "plan-time.svg", "plan-tensions.svg"})
    EXPECT_TRUE(std::filesystem::exists(mine_ / "pictures" / picture)) << picture;
}

TEST_F(PlanVerb, PlansATurntableAndAHand) {
  for (const std::string robot : {"turntable", "hand"}) {
    const auto run = plan({"--robot", robot, "--steps", "36x3", "--phi", "30..80", "--json"});
    ASSERT_EQ(run.status, 0) << run.err;
    const auto json = nlohmann::json::parse(run.out);
    EXPECT_EQ(json["photographs"], 108);
    EXPECT_TRUE(json["cut_off"].empty()) << "the radius that it chose shows the whole object";
    const capture::Plan plan = capture::read_plan(mine("plan.json"));
    EXPECT_EQ(plan.robot, robot);
    EXPECT_FALSE(plan.mechanism);
  }
}

TEST_F(PlanVerb, LeavesMoreOfThePictureFreeForARobotThatErrs) {
  const auto radius = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--steps", "3x1", "--phi", "60..60", "--kicks", "1", "--json"});
    const auto run = plan(words, "0.35");
    EXPECT_EQ(run.status, 0) << run.err;
    return run.status ? 0 : nlohmann::json::parse(run.out)["radius_m"].get<double>();
  };
  for (const std::string robot : {"cables", "hand", "turntable"}) {
    const double chosen = radius({"--robot", robot});
    EXPECT_EQ(chosen, radius({"--robot", robot, "--margin", robot == "turntable" ? "0.05" : "0.1"})) << robot;
    EXPECT_NE(chosen, radius({"--robot", robot, "--margin", "0.08"})) << robot;
  }
  EXPECT_EQ(plan({"--margin", "0.5"}).status, 2);
  EXPECT_EQ(plan({"--margin", "-0.1"}).status, 2);
}

TEST_F(PlanVerb, PlansVisitsForRepeatability) {
  const auto run = plan({"--repeatability", "3"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(capture::read_plan(mine("plan.json")).stops.size(), 100u);
  EXPECT_EQ(plan({"--repeatability", "-3"}).status, 2);
  EXPECT_EQ(plan({"--repeatability", "12"}).status, 1);
}

TEST_F(PlanVerb, SaysWhyNothingIsInReach) {
  const auto run = plan({"--radius", "8"});
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.err, HasSubstr("none of the 240 stops can be taken"));
  EXPECT_THAT(run.err, HasSubstr("outside of the room"));
  EXPECT_FALSE(std::filesystem::exists(mine("plan.json")));
}

TEST_F(PlanVerb, RefusesWhatMakesNoPlan) {
  const std::vector<std::vector<std::string>> wrong = {
      {"--steps", "24"},   {"--steps", "24x0"},     {"--steps", "24.5x3"}, {"--settle", "-1"},
      {"--lens", "0"},     {"--exposure", "-0.5"},  {"--phi", "90..0"},    {"--sensor", "0x15"},
      {"--robot", "legs"}, {"--spacing-deg", "-3"}, {"--pixels", "axb"},   {"--overlap", "1.5"},
      {"--scatter", "-1"}, {"--center", "1,2,nan"}};
  for (const auto& words : wrong) {
    const auto run = plan(words);
    EXPECT_EQ(run.status, 2) << words[0] << " " << words[1] << ": " << run.err;
    EXPECT_FALSE(std::filesystem::exists(mine("plan.json")));
  }
  EXPECT_EQ(plan({}, "0").status, 2);
  EXPECT_EQ(plan({"--mechanism", mine("none.json")}).status, 1);
  write_file(mine("bad.json"), "{}");
  const auto run = plan({"--mechanism", mine("bad.json")});
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.err, HasSubstr("bad.json"));
}

}  // namespace
}  // namespace lumihull
