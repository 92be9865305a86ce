// plan.json: exact round trips, and every field that is not what it should be named.
#include <lumihull/base/files.h>
#include <lumihull/capture/trajectory.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "support.h"

namespace lumihull::capture {
namespace {

using nlohmann::json;
using testing::HasSubstr;

Plan small_plan() {
  Plan plan;
  plan.robot = "cables";
  plan.mechanism = paper_mechanism();
  plan.object = KeepOut{{0, 0, -1}, 0.3, 1.2};
  plan.cameras = {"left", "right"};
  HemisphereOptions o;
  o.azimuths = 3, o.rows = 2;
  plan.stops = hemisphere_stops(*plan.mechanism, o);
  plan.stops[1].travel_s = 1.0 / 3;
  plan.stops[2].photograph = false, plan.stops[2].exposure_s = 0;
  plan.stops[3].pause = "Change the battery.";
  return plan;
}

class PlanFile : public testing::Test {
 protected:
  json written(const Plan& plan) {
    write_plan(plan, file_);
    return json::parse(read_file(file_));
  }
  std::string complaint(const json& bad) {
    write_file(file_, bad.dump());
    const Error e = test::expect_error([&] { read_plan(file_); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input) << e.what();
    EXPECT_EQ(e.subject(), file_.string());
    return e.message();
  }
  test::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "plan.json";
};

TEST_F(PlanFile, RoundTripIsExact) {
  const Plan plan = small_plan();
  write_plan(plan, file_);
  const std::string text = read_file(file_);
  const Plan read = read_plan(file_);
  ASSERT_EQ(read.stops.size(), plan.stops.size());
  for (std::size_t i = 0; i < plan.stops.size(); ++i) {
    const PlannedStop &a = plan.stops[i], &b = read.stops[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.theta_rad, b.theta_rad);
    EXPECT_EQ(a.world_from_platform.translation, b.world_from_platform.translation);
    EXPECT_EQ(a.world_from_platform.rotation.coeffs(), b.world_from_platform.rotation.coeffs());
    EXPECT_EQ(a.cam_from_world.rotation.coeffs(), b.cam_from_world.rotation.coeffs());
    EXPECT_EQ(a.lengths_m, b.lengths_m);
    EXPECT_EQ(a.travel_s, b.travel_s);
    EXPECT_EQ(a.photograph, b.photograph);
    EXPECT_EQ(a.pause, b.pause);
  }
  EXPECT_EQ(read.cameras, plan.cameras);
  EXPECT_EQ(read.object->radius_m, 0.3);
  write_plan(read, file_);
  EXPECT_EQ(read_file(file_), text);
}

TEST_F(PlanFile, EveryFieldMustBeThere) {
  const json good = written(small_plan());
  for (const char* at : {"/format",
                         "/version",
                         "/robot",
                         "/mechanism",
                         "/cameras",
                         "/stops",
                         "/object/base",
                         "/object/radius_m",
                         "/object/height_m",
                         "/stops/1/name",
                         "/stops/1/theta_rad",
                         "/stops/1/phi_rad",
                         "/stops/1/roll_rad",
                         "/stops/1/world_from_platform",
                         "/stops/1/cam_from_world",
                         "/stops/1/lengths_m",
                         "/stops/1/travel_s",
                         "/stops/1/settle_s",
                         "/stops/1/exposure_s",
                         "/stops/1/photograph"}) {
    const json::json_pointer pointer(at);
    json bad = good;
    bad[pointer.parent_pointer()].erase(pointer.back());
    EXPECT_THAT(complaint(bad), HasSubstr(pointer.back())) << at;
  }
}

TEST_F(PlanFile, EveryWrongFieldIsNamed) {
  const json good = written(small_plan());
  const std::vector<std::pair<std::string, json>> wrong = {
      {"/format", "lumihull-mechanism"},
      {"/version", 2},
      {"/robot", "legs"},
      {"/object/radius_m", 0},
      {"/object/height_m", -1},
      {"/object/base/1", "x"},
      {"/cameras", json::array()},
      {"/cameras/1", "left"},
      {"/cameras/0", "a/b"},
      {"/stops", json::array()},
      {"/stops/1/name", ""},
      {"/stops/1/name", "../x"},
      {"/stops/1/name", ".hidden"},
      {"/stops/1/name", std::string(101, 'a')},
      {"/stops/1/name", good["stops"][0]["name"]},
      {"/stops/1/phi_rad", -0.1},
      {"/stops/1/phi_rad", 3.2},
      {"/stops/1/theta_rad", 1e3},
      {"/stops/1/roll_rad", nullptr},
      {"/stops/1/travel_s", -1},
      {"/stops/1/settle_s", -1e-9},
      {"/stops/1/exposure_s", 0},
      {"/stops/1/exposure_s", 1e9},
      {"/stops/1/photograph", 1},
      {"/stops/3/pause", "two\nlines"},
      {"/stops/3/pause", std::string(600, 'x')},
      {"/stops/1/lengths_m/2", good["stops"][1]["lengths_m"][2].get<double>() + 2e-6},
      {"/stops/1/lengths_m", json::array({1, 2, 3})},
      {"/stops/1/world_from_platform/q", json::array({1, 1, 0, 0})},
      {"/stops/1/world_from_platform/t", json::array({1, 0})},
      {"/stops/1/world_from_platform/t", json::array({0, 0, 7})},
      {"/stops/1/cam_from_world/t/0", 1e9},
  };
  for (const auto& [at, value] : wrong) {
    json bad = good;
    bad[json::json_pointer(at)] = value;
    EXPECT_THAT(complaint(bad), HasSubstr("at " + at)) << value;
  }
  json bad = good;
  bad["robot"] = "hand";
  EXPECT_THAT(complaint(bad), HasSubstr("at /mechanism"));
  for (int i = 0; i < 20; ++i) bad["cameras"].push_back("c" + std::to_string(i));
  EXPECT_THAT(complaint(bad), HasSubstr("at most 16"));
}

TEST_F(PlanFile, LengthsStayWithinTheWinches) {
  Plan plan = small_plan();
  plan.mechanism->cables[2].max_length_m = 0.5 * plan.stops[0].lengths_m[2];
  Error e = test::expect_error([&] { check(plan, "mine"); });
  EXPECT_THAT(e.what(), HasSubstr("mine: at /stops/0/lengths_m/2: expected what the winch can do"));
  plan = small_plan();
  plan.mechanism->cables[1].min_length_m = 15;
  e = test::expect_error([&] { check(plan); });
  EXPECT_THAT(e.what(), HasSubstr("/lengths_m/1"));
  plan = small_plan();
  plan.stops[1].lengths_m[0] = std::numeric_limits<double>::quiet_NaN();
  e = test::expect_error([&] { check(plan); });
  EXPECT_THAT(e.what(), HasSubstr("/stops/1/lengths_m/0"));
}

TEST_F(PlanFile, APlanTakesAtLeastOnePhotograph) {
  Plan plan = small_plan();
  for (PlannedStop& stop : plan.stops) stop.photograph = false;
  EXPECT_THAT(test::expect_error([&] { check(plan); }).what(), HasSubstr("a stop where a photograph is taken"));
}

TEST_F(PlanFile, WithoutAMechanismThereAreNoLengths) {
  Plan plan;
  plan.robot = "turntable";
  plan.cameras = {"camera"};
  plan.stops = hemisphere_views({}, Orientation::portrait);
  EXPECT_NO_THROW(check(plan));
  plan.stops[5].lengths_m = {1};
  EXPECT_THAT(test::expect_error([&] { check(plan); }).what(), HasSubstr("/stops/5/lengths_m"));
}

TEST_F(PlanFile, ManyStopsAreReadAndTooManyRefused) {
  Plan plan;
  plan.robot = "hand";
  plan.cameras = {"camera"};
  plan.stops.resize(kMaxPlannedStops);
  for (std::size_t i = 0; i < plan.stops.size(); ++i) plan.stops[i].name = "s" + std::to_string(i);
  EXPECT_NO_THROW(check(plan));
  plan.stops.resize(5000);
  write_plan(plan, file_);
  EXPECT_EQ(read_plan(file_).stops.size(), 5000u);
  plan.stops.resize(kMaxPlannedStops + 1);
  EXPECT_THAT(test::expect_error([&] { check(plan); }).what(), HasSubstr("1 to 100000 stops"));
}

TEST_F(PlanFile, WhatIsNoJsonIsRefused) {
  for (const char* text : {"", "{", "[]", "null", "{\"format\": 3}", "\xff\xfe"}) {
    write_file(file_, text);
    EXPECT_EQ(test::expect_error([&] { read_plan(file_); }).code(), ErrorCode::bad_input) << text;
  }
  EXPECT_EQ(test::expect_error([&] { read_plan(folder_ / "none"); }).code(), ErrorCode::not_found);
}

}  // namespace
}  // namespace lumihull::capture
