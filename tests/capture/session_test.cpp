// Captures that go well, and how they are gone on with.

#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/capture/operator_robot.h>
#include <lumihull/capture/statics.h>

#include <fstream>

#include "session_scene.h"

namespace lumihull::capture {
namespace {

namespace fs = std::filesystem;
using About = Question::About;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> names(const Plan& plan) {
  std::vector<std::string> out;
  for (const PlannedStop& stop : plan.stops) out.push_back(stop.name);
  return out;
}

TEST(Session, TakesEveryViewInThePlansOrder) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(12));
  const SessionResult result = scene.run();
  EXPECT_EQ(result.views, 12u);
  EXPECT_EQ(result.of, 12u);
  EXPECT_EQ(result.taken, 12u);
  EXPECT_FALSE(result.paused);
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(scene.moves, names(scene.plan));
  scene.expect_complete();
  EXPECT_EQ(scene.exposures("main").size(), 12u);
  EXPECT_EQ(scene.who.count(About::motion), 1u);

  const Capture capture = Capture::open(scene.folder);
  ASSERT_EQ(capture.cameras.size(), 1u);
  EXPECT_EQ(capture.cameras[0].width, 96);
  const Shot& shot = capture.shots[3];
  EXPECT_EQ(shot.name, "a003-e00-main");
  ASSERT_TRUE(shot.commanded);
  EXPECT_EQ(shot.commanded->cam_from_world.translation, scene.plan.stops[3].cam_from_world.translation);
  EXPECT_EQ(shot.commanded->settle_s, 0.0005);
  EXPECT_EQ(shot.commanded->exposure_s, 0.001);
  EXPECT_EQ(shot.commanded->attempts, 1);
  EXPECT_EQ(shot.commanded->state, "done");
  EXPECT_EQ(shot.commanded->plan_sha256, sha256_of_file(scene.folder / "plan.json"));
  EXPECT_FALSE(shot.cam_from_world);  // commanded is not measured
  EXPECT_EQ(capture.read_photo(3).width(), 96);
}

TEST(Session, DoesNothingWhereEverythingIsDone) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(3));
  scene.run();
  scene.moves.clear();
  const SessionResult again = scene.run();
  EXPECT_EQ(again.taken, 0u);
  EXPECT_EQ(again.views, 3u);
  EXPECT_TRUE(scene.moves.empty());
  EXPECT_EQ(scene.who.count(About::motion), 1u);  // nothing moves: nobody is asked
  scene.expect_complete();
}

TEST(Session, ARigOfTwoCamerasHasAnEntryAStopAndCamera) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(5, {"left", "right"}));
  scene.options.names = "{number}_{camera}";
  EXPECT_EQ(scene.run().views, 10u);
  scene.expect_complete();
  EXPECT_EQ(scene.moves.size(), 5u);
  const Capture capture = Capture::open(scene.folder);
  EXPECT_EQ(capture.shots[1].name, "0001_right");
  EXPECT_EQ(capture.shots[9].name, "0005_right");
  EXPECT_EQ(capture.cameras.size(), 2u);  // two lenses, though of one size
  EXPECT_NE(capture.shots[0].camera, capture.shots[1].camera);
}

TEST(Session, PausesAndGoesOn) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(10, {"left", "right"}));
  scene.options.pause_after = 7;
  SessionResult result = scene.run();
  EXPECT_TRUE(result.paused);
  EXPECT_EQ(result.views, 7u);
  EXPECT_TRUE(scene.ended_safe);
  EXPECT_EQ(scene.state().last, EventKind::paused);
  EXPECT_EQ(Capture::open(scene.folder).shots.size(), 7u);
  scene.options.pause_after = 0;
  result = scene.run();
  EXPECT_EQ(result.taken, 13u);
  scene.expect_complete();
}

TEST(Session, RetakesAStopAndKeepsTheOldPhotograph) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(4));
  scene.run();
  {
    Capture capture = Capture::open(scene.folder);
    for (Shot& shot : capture.shots) shot.cam_from_world = Pose{};
    capture.shots[2].mask_source = MaskSource::keyed;
    capture.shots[2].mask_sha256 = std::string(64, 'a');
    capture.save();
  }
  const std::string old = sha256_of_file(scene.folder / "photos" / "a002-e00-main.jpg");
  scene.options.retake = "a002-e00";
  EXPECT_EQ(scene.run().taken, 1u);
  scene.expect_complete();
  EXPECT_EQ(sha256_of_file(scene.folder / "photos" / "a002-e00-main.jpg"), old);
  const Capture capture = Capture::open(scene.folder);
  ASSERT_EQ(capture.shots.size(), 4u);
  EXPECT_EQ(capture.shots[2].file, "photos/a002-e00-main~2.jpg");
  EXPECT_EQ(capture.shots[2].name, "a002-e00-main");
  EXPECT_TRUE(capture.positioned(1));
  EXPECT_FALSE(capture.positioned(2));  // the pose was the old photograph's
  EXPECT_EQ(capture.shots[2].mask_source, MaskSource::keyed);
  EXPECT_EQ(capture.cameras.size(), 1u);
  EXPECT_EQ(scene.run().taken, 1u);  // and once more
  EXPECT_TRUE(fs::exists(scene.folder / "photos" / "a002-e00-main~3.jpg"));
  scene.options.retake = "nowhere";
  EXPECT_THAT(test::expect_error([&] { scene.run(); }).message(), HasSubstr("nowhere"));
}

TEST(Session, ACablesRobotGoesAlongThePlanAndOutStraightUp) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::cable_plan(4, 2));
  scene.who.answers[About::position] = {scene.plan.stops[0].name};
  scene.run();
  scene.expect_complete();
  EXPECT_EQ(scene.who.count(About::position), 1u);  // it did not know where it was
  std::vector<std::string> planned = names(scene.plan);
  planned.erase(planned.begin());  // it was declared to be there
  EXPECT_EQ(scene.moves, planned);
  // After a restart, from the last stop to the second, both low: up over the object, over, down.
  scene.moves.clear();
  scene.ways.clear();
  scene.options.retake = scene.plan.stops[1].name;
  scene.run();
  EXPECT_EQ(scene.who.count(About::position), 1u);  // the controller still knew
  EXPECT_THAT(scene.moves, ElementsAre("above", "above", scene.plan.stops[1].name));
  const Eigen::Vector3d from = scene.plan.stops[7].world_from_platform.translation,
                        to = scene.plan.stops[1].world_from_platform.translation,
                        up = scene.ways[0].world_from_platform.translation,
                        over = scene.ways[1].world_from_platform.translation;
  const double top = 0.25;  // of the object
  EXPECT_LT((up - from).head<2>().norm(), 1e-9);
  EXPECT_GT(up.z(), top + scene.plan.mechanism->platform_radius_m);
  EXPECT_LT((over - to).head<2>().norm(), 1e-9);
  EXPECT_NEAR(over.z(), up.z(), 1e-9);
  for (const PlannedStop& way : scene.ways) {
    const CableVector lengths = cable_lengths(*scene.plan.mechanism, way.world_from_platform);
    ASSERT_EQ(way.lengths_m.size(), 6u);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(way.lengths_m[std::size_t(i)], lengths[i], 1e-9);
  }
}

TEST(Session, AControllerThatForgotIsToldWhereThePlatformIs) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::cable_plan(3, 2));
  scene.robot_remembers = false;
  scene.options.pause_after = 2;
  scene.who.answers[About::position] = {scene.plan.stops[0].name};
  scene.run();
  scene.options.pause_after = 0;
  scene.who.answers[About::position] = {"stop"};
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::cancelled);
  EXPECT_TRUE(scene.ended_safe);
  const Question& question = scene.who.asked.back();
  EXPECT_EQ(question.about, About::position);
  EXPECT_EQ(question.choices.front(), scene.plan.stops[1].name);  // where it was last
  EXPECT_EQ(question.choices.back(), "stop");
  const std::size_t moved = scene.moves.size();
  scene.who.answers[About::position] = {scene.plan.stops[1].name};
  scene.who.answers[About::motion] = {"stop"};
  EXPECT_EQ(test::expect_error([&] { scene.run(); }).code(), ErrorCode::cancelled);
  EXPECT_EQ(scene.moves.size(), moved);  // nothing moves before the operator agrees
  scene.who.answers.erase(About::motion);
  scene.run();
  scene.expect_complete();
}

TEST(Session, TheCameraIsTurnedWhereThePlanTurnsIt) {
  const test::TemporaryFolder folder;
  Plan plan = test::cable_plan(4, 2);
  // Stops 4 … 7 in portrait; turned at a place that is only passed.
  for (std::size_t i = 4; i < plan.stops.size(); ++i) plan.stops[i].roll_rad = 1.5;
  PlannedStop turning = plan.stops[4];
  turning.name = "turning";
  turning.photograph = false;
  turning.exposure_s = 0;
  plan.stops.insert(plan.stops.begin() + 4, turning);
  test::Scene scene(folder.path(), plan);
  std::vector<std::string> record;
  scene.prepare = [&](capture::SimulatedRobot& robot, auto&) {
    robot.on_roll = [&](double roll) { record.push_back(robot.stop() + (roll > 1 ? " portrait" : " landscape")); };
  };
  scene.who.answers[About::position] = {plan.stops[0].name};
  scene.options.pause_after = 6;
  scene.run();
  EXPECT_THAT(record, ElementsAre(plan.stops[0].name + " landscape", "turning portrait"));
  scene.options.pause_after = 0;
  scene.run();
  EXPECT_EQ(record.size(), 2u);  // locked: it stays as it was
  EXPECT_EQ(scene.exposures("main").size(), 8u);
  const std::size_t before = scene.moves.size();
  scene.options.retake = plan.stops[1].name;  // in landscape, turned back where the plan begins
  scene.run();
  EXPECT_EQ(record.back(), plan.stops[0].name + " landscape");
  scene.options.retake = plan.stops[6].name;
  scene.run();
  EXPECT_EQ(record.back(), "turning portrait");
  EXPECT_THAT(std::vector<std::string>(scene.moves.begin() + std::ptrdiff_t(before), scene.moves.end()),
              testing::Contains("turning"));
  EXPECT_EQ(Capture::open(scene.folder).shots.size(), 8u);
}

TEST(Session, ThePlansPausesAskTheOperator) {
  const test::TemporaryFolder folder;
  Plan plan = test::turntable_plan(4);
  plan.stops[2].pause = "change the battery";
  test::Scene scene(folder.path(), plan);
  scene.run();
  EXPECT_EQ(scene.who.count(About::task), 1u);
  EXPECT_EQ(scene.who.asked.back().text, "change the battery");
  scene.expect_complete();
}

TEST(Session, FilesThatStayOnTheCardAreAwaited) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(4));
  scene.delivers = false;
  SessionResult result = scene.run();
  EXPECT_EQ(result.views, 0u);
  EXPECT_EQ(result.awaited, 4u);
  EXPECT_FALSE(fs::exists(scene.folder / "capture.json"));
  EXPECT_EQ(scene.run().taken, 0u);  // nothing is taken twice
  // As ingest does it.
  Journal journal = Journal::open(journal_path(scene.folder));
  for (const auto& e : scene.exposures("main"))
    land_photograph(journal, scene.folder, e.shot, scene.memory / "card" / ("IMG_" + std::to_string(e.shot) + ".jpg"));
  update_capture(scene.folder, scene.plan, journal.state());
  scene.expect_complete();
  EXPECT_TRUE(fs::exists(scene.memory / "card" / "IMG_1.jpg"));  // the card is left as it is
}

TEST(Session, KnownIntrinsicsAreTaken) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(2));
  scene.options.intrinsics["main"] = {.width = 96, .height = 64, .f = 77, .u0 = 48, .v0 = 32, .k1 = -0.1};
  scene.run();
  EXPECT_EQ(Capture::open(scene.folder).cameras.at(0).k1, -0.1);
  test::Scene other(folder / "other", test::turntable_plan(2));
  other.options.intrinsics["main"] = {.width = 640, .height = 480, .f = 77, .u0 = 48, .v0 = 32};
  EXPECT_THAT(test::expect_error([&] { other.run(); }).message(), HasSubstr("640 x 480"));
  EXPECT_TRUE(other.ended_safe);
  other.options.intrinsics.clear();
  other.run();
  other.expect_complete();
}

TEST(Session, WhoTurnsATableByHandIsAskedForEachStop) {
  const test::TemporaryFolder folder;
  const Plan plan = test::turntable_plan(4);
  test::ScriptedOperator who;
  OperatorRobot robot(OperatorRobot::Moves::turntable, who);
  OperatorCamera camera(who);
  CameraDevice* cameras[] = {&camera};
  Job job;
  const SessionResult result = capture::capture(plan, robot, cameras, folder / "c", {}, who, job);
  EXPECT_EQ(result.awaited, 4u);
  std::vector<std::string> tasks;
  for (const Question& question : who.asked)
    if (question.about == About::task) tasks.push_back(question.text);
  ASSERT_EQ(tasks.size(), 9u);  // hold the camera; then turn and press, four times
  EXPECT_THAT(tasks[3], HasSubstr("turn the table to 90.0°"));
  EXPECT_THAT(tasks[4], HasSubstr("press the shutter"));
  OperatorRobot hand(OperatorRobot::Moves::camera, who);
  hand.move_to(plan.stops[1], job);
  EXPECT_THAT(who.asked.back().text, HasSubstr("move the camera to x 0.00, y 1.00, z 0.40 m"));
  who.answers[About::task] = {"stop"};
  EXPECT_EQ(test::expect_error([&] { hand.move_to(plan.stops[1], job); }).code(), ErrorCode::cancelled);
}

TEST(Session, TheContactSheetShowsEveryPhotographsState) {
  const test::TemporaryFolder folder;
  test::Scene scene(folder.path(), test::turntable_plan(6));
  scene.options.pause_after = 4;
  scene.run();
  std::string page = read_file(scene.folder / "contact.html");
  const auto count = [&](const std::string& text) {
    std::size_t n = 0;
    for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count(" class=\"done\">"), 4u);
  EXPECT_EQ(count(" class=\"wait\">"), 2u);
  EXPECT_EQ(count("http-equiv=\"refresh\""), 0u);
  EXPECT_EQ(count("4 of 6 photographs"), 1u);
  EXPECT_EQ(count("to look at"), 0u);
  for (std::size_t at = page.find("src=\""); at != std::string::npos; at = page.find("src=\"", at + 1)) {
    const std::string link = page.substr(at + 5, page.find('"', at + 5) - at - 5);
    EXPECT_GT(read_image(scene.folder / link).width(), 0) << link;
  }
  // Photographs that are wrong are marked, and one that can't be read does no harm.
  write_jpeg(scene.folder / "photos" / "a000-e00-main.jpg", Image(96, 64, 3));
  std::ofstream(scene.folder / "photos" / "a001-e00-main.jpg") << "no picture";
  fs::remove_all(scene.folder / "thumbs");
  write_contact_sheet(scene.folder, scene.plan, scene.state(), "going on", 60);
  page = read_file(scene.folder / "contact.html");
  EXPECT_EQ(count("<em>dark</em>"), 1u);
  EXPECT_EQ(count("<em>unreadable</em>"), 1u);
  EXPECT_EQ(count("to look at: <a href=\"#a000-e00-0\">a000-e00</a>, <a href=\"#a001-e00-0\">a001-e00</a></p>"), 1u);
  EXPECT_EQ(count("<figure id=\"a000-e00-0\""), 1u);
  EXPECT_EQ(count("http-equiv=\"refresh\""), 1u);
}

}  // namespace
}  // namespace lumihull::capture
