// lumihull calibrate: from photographs of printed targets to poses, as people type it.
#include <lumihull/base/capture.h>
#include <lumihull/base/files.h>
#include <lumihull/base/image.h>
#include <lumihull/rig/flat_print.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "process.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::lumihull;
using testing::AllOf;
using testing::HasSubstr;

/// Eight photographs of five ArUco markers on a table.
class CalibrateVerb : public testing::Test {
 protected:
  static constexpr int kPhotos = 8;
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    for (int i = 0; i < kPhotos; ++i)
      photograph({{.width = 480, .height = 360, .f = 560, .u0 = 240, .v0 = 180}, pose(i)},
                 *folder_ / ("photo" + std::to_string(i) + ".png"), std::uint64_t(i));
  }
  static void TearDownTestSuite() { delete folder_; }
  static calib::TargetSet set() { return calib::TargetSet::from_word("aruco:6x6_250:35mm"); }
  static Pose world_from_target(int i) {  // of id 10 + i
    return {Eigen::Quaterniond(0, 1, 0, 0), {0.07 * std::cos(1.3 * i), 0.07 * std::sin(1.3 * i), 0}};
  }
  static Pose pose(int photo) {
    const double turn = 2 * std::numbers::pi * photo / kPhotos;
    return look_at({.2 * std::cos(turn), .2 * std::sin(turn), photo % 2 ? .2 : .3}, {0, 0, 0}, {0, 0, 1});
  }
  static void photograph(const View& view, const fs::path& file, std::uint64_t seed) {
    std::vector<rig::FlatPrint> prints;
    for (int i = 0; i < 5; ++i) {
      prints.push_back(rig::print_of(set().designs[0], 10 + i));
      prints.back().world_from_print = world_from_target(i);
    }
    write_png(file, rig::photograph_prints(view, prints, {.3f, .3f, .3f}, {.blur_px = .7, .noise_read = .004}, seed));
  }
  /// A bar between corners of targets 10 + i and 10 + k, as it is typed, its length times `stretch`.
  static std::string bar(int i, int k, double stretch) {
    const Eigen::Vector2d a = set().designs[0].feature(0), b = set().designs[0].feature(2);
    const double length = (world_from_target(i) * Eigen::Vector3d(a.x(), a.y(), 0) -
                           world_from_target(k) * Eigen::Vector3d(b.x(), b.y(), 0))
                              .norm();
    return std::to_string(10 + i) + ".0," + std::to_string(10 + k) + ".2," + std::to_string(stretch * length) +
           ",0.05mm";
  }
  std::string import_photos(const std::string& name = "cap") {
    std::vector<std::string> command{"import", "photos"};
    for (int i = 0; i < kPhotos; ++i) command.push_back((*folder_ / ("photo" + std::to_string(i) + ".png")).string());
    const std::string capture = (mine_ / name).string();
    command.insert(command.end(), {"-o", capture, "--quiet"});
    const auto outcome = lumihull(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return capture;
  }
  static inline test::TemporaryFolder* folder_ = nullptr;
  test::TemporaryFolder mine_;
};

TEST_F(CalibrateVerb, PlacesThePhotographsAndSaysHowWell) {
  const std::string capture = import_photos();
  const auto outcome = lumihull({"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--json", "--quiet"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["photos"], kPhotos);
  EXPECT_EQ(json["photos_placed"], kPhotos);
  EXPECT_EQ(json["targets"], 5);
  EXPECT_LT(json["rms_px"], 0.5);
  EXPECT_GT(json["sigma0"], 0.0);
  EXPECT_NEAR(json["intrinsics"][0]["f"].get<double>(), 560, 15);
  EXPECT_TRUE(json["removed"].is_array());
  EXPECT_TRUE(json.contains("cross_validation"));
  EXPECT_FALSE(json["verdict"].get<std::string>().empty());
  EXPECT_THAT(outcome.err, HasSubstr("8 of 8 photographs"));
  for (const char* file : {"targets.json", "calibration.html", "detections/photo0.json"})
    EXPECT_TRUE(fs::exists(fs::path(capture) / file)) << file;
  const Capture stored = Capture::open(capture);
  const double apart = (stored.view(0).center() - stored.view(4).center()).norm();
  EXPECT_NEAR(apart, 0.4, 0.004);

  const auto again = lumihull({"calibrate", capture});
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(again.out, HasSubstr("nothing has changed"));
  const auto info = lumihull({"info", capture});
  EXPECT_EQ(nlohmann::json::parse(info.out)["photos_positioned"], kPhotos);
  const auto exported = lumihull({"export", "colmap", capture, "-o", (mine_ / "colmap").string()});
  EXPECT_EQ(exported.status, 0) << exported.err;
  EXPECT_GT(read_file(mine_ / "colmap/points3D.txt").size(), 1000u);
}

TEST_F(CalibrateVerb, RunDoesItWhereTargetsAreNamed) {
  const std::string capture = import_photos();
  // Nothing else can be made of photographs of a table: the next stage fails at once, for there is no enclosure.
  const auto without = lumihull({"run", capture, "--background", "enclosure", "--quiet"});
  EXPECT_THAT(without.out, HasSubstr("no targets are named"));
  EXPECT_FALSE(Capture::open(capture).positioned(0));
  const auto with =
      lumihull({"run", capture, "--targets", "aruco:6x6_250:35mm", "--background", "enclosure", "--quiet"});
  EXPECT_THAT(with.out, HasSubstr("8 of 8 photographs"));
  EXPECT_TRUE(Capture::open(capture).positioned(0));
  const auto again = lumihull({"run", capture, "--background", "enclosure", "--quiet"});
  EXPECT_THAT(again.out, HasSubstr("calibrate  nothing has changed"));
}

TEST_F(CalibrateVerb, ImportedPosesAreLeftAloneUnlessAskedForByName) {
  const std::string folder = import_photos();
  Capture capture = Capture::open(folder);
  capture.cameras[0] = {.width = 480, .height = 360, .f = 555, .u0 = 240, .v0 = 180};
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    capture.shots[i].cam_from_world = look_at({double(i), 1, 5}, {0, 0, 0}, {0, 0, 1});
  capture.save();
  const auto run = lumihull({"run", folder, "--targets", "aruco:6x6_250:35mm", "--background", "enclosure", "--quiet"});
  EXPECT_THAT(run.out, HasSubstr("poses were imported"));
  EXPECT_EQ(Capture::open(folder).view(3).center(), capture.view(3).center());
  const auto asked =
      lumihull({"calibrate", folder, "--targets", "aruco:6x6_250:35mm", "--intrinsics", "fixed", "--quiet"});
  EXPECT_EQ(asked.status, 0) << asked.err;
  const Capture stored = Capture::open(folder);
  EXPECT_NE(stored.view(3).center(), capture.view(3).center());
  EXPECT_EQ(stored.cameras[0].f, 555);
}

TEST_F(CalibrateVerb, GoesOnAfterAKill) {
  const std::string capture = import_photos();
  const std::vector<std::string> command{"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--quiet"};
  for (const double after : {0.02, 0.1, 0.3})
    for (const int signal : {2, 9}) {
      lumihull(command, {.kill_after_s = after, .signal = signal});
      EXPECT_NO_THROW(Capture::open(capture)) << after;
    }
  const auto outcome = lumihull(command);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(Capture::open(capture).positioned(7));
}

TEST_F(CalibrateVerb, BarsGiveThePrintsScale) {
  const std::string capture = import_photos();
  // Printed 2 % too large: bars across the sheet say so.
  std::vector<std::string> command{"calibrate", capture,         "--targets", "aruco:6x6_250:35mm",
                                   "--bar",     bar(0, 2, 1.02), "--bar",     bar(1, 3, 1.02),
                                   "--json",    "--quiet"};
  auto outcome = lumihull(command);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["print_scale"][0], 1.0);
  EXPECT_THAT(json["warnings"].dump(), AllOf(HasSubstr("scale bar 10.0,12.2"), HasSubstr("scale bar 11.0,13.2"),
                                             HasSubstr("contradicts the targets' size")));
  EXPECT_THAT(json["verdict"].get<std::string>(), HasSubstr("2 of the scale bars can't be true"));

  outcome = lumihull({"calibrate", capture, "--free-print-scale", "--json", "--quiet"});  // the bars are stored
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  json = nlohmann::json::parse(outcome.out);
  for (const int axis : {0, 1}) EXPECT_NEAR(json["print_scale"][axis].get<double>(), 1.02, 2e-3) << axis;
  EXPECT_THAT(json["warnings"].dump(), testing::Not(HasSubstr("scale bar")));
  const Capture stored = Capture::open(capture);
  EXPECT_NEAR((stored.view(0).center() - stored.view(4).center()).norm(), 0.4 * 1.02, 0.004);
  EXPECT_EQ(std::get<std::string>(stored.options.at("calibrate").at("bar")), bar(0, 2, 1.02) + ";" + bar(1, 3, 1.02));

  // Bars that contradict each other, whatever the scale.
  outcome = lumihull({"calibrate", capture, "--bar", bar(0, 2, 1.02) + "; " + bar(1, 3, 0.99), "--json", "--quiet"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  json = nlohmann::json::parse(outcome.out);
  EXPECT_THAT(json["warnings"].dump(), HasSubstr("contradicts another bar"));
  EXPECT_THAT(json["verdict"].get<std::string>(), HasSubstr("scale bars can't be true"));
}

TEST_F(CalibrateVerb, BarsThatAreNoneAreRefused) {
  const std::string capture = import_photos();
  const auto refused = [&](const std::string& bars, const char* says) {
    const auto outcome = lumihull({"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--bar", bars, "--quiet"});
    EXPECT_EQ(outcome.status, 2) << bars;
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("bar"), HasSubstr(says))) << bars;
  };
  refused("10.0,12.2", "ID.POINT,ID.POINT,LENGTH");
  refused("10,12.2,0.1", "ID.POINT");
  refused("10.0,12.2,-0.1", "above 0");
  refused("10.0,12.2,5ft", "mm, cm or m");
  refused("10.0,99.2,0.1", "no photograph shows target 99");
  refused("10.0,12.4,0.1", "target 12 has no point 4");
  refused("10.0,10.0,0.1", "two points");
  const auto scale = lumihull({"calibrate", capture, "--bar", "default", "--free-print-scale", "--quiet"});
  EXPECT_EQ(scale.status, 2);
  EXPECT_THAT(scale.err, HasSubstr("can only be told from scale bars"));
  EXPECT_FALSE(Capture::open(capture).positioned(0));
}

TEST_F(CalibrateVerb, TheNthPhotographsOfARigAreOfOneMoment) {
  const std::string one_camera = import_photos("one");
  const auto alone = lumihull({"calibrate", one_camera, "--targets", "aruco:6x6_250:35mm", "--rig", "--quiet"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr("expected several cameras"));

  const Pose second{Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())), {-0.04, 0.01, 0.005}};
  std::vector<std::string> command{"import", "photos"};
  for (int i = 0; i < kPhotos; ++i) command.push_back((*folder_ / ("photo" + std::to_string(i) + ".png")).string());
  for (int i = 0; i < kPhotos; ++i) {
    const fs::path file = mine_ / ("second" + std::to_string(i) + ".png");
    photograph({{.width = 400, .height = 320, .f = 450, .u0 = 200, .v0 = 160}, second * pose(i)}, file,
               100 + std::uint64_t(i));
    command.push_back(file.string());
  }
  const auto import = [&](const std::string& name) {
    std::vector<std::string> all = command;
    all.insert(all.end(), {"-o", (mine_ / name).string(), "--quiet"});
    const auto outcome = lumihull(all);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return (mine_ / name).string();
  };
  const std::string capture = import("rig");
  const auto outcome = lumihull({"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--rig", "--quiet"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Capture stored = Capture::open(capture);
  ASSERT_EQ(stored.cameras.size(), 2u);
  std::vector<Pose> between;
  for (std::size_t i = 0; i < kPhotos; ++i) {
    ASSERT_TRUE(stored.positioned(i) && stored.positioned(kPhotos + i)) << i;
    between.push_back(*stored.shots[kPhotos + i].cam_from_world * stored.shots[i].cam_from_world->inverse());
    EXPECT_LT((between[i].translation - between[0].translation).norm(), 1e-9) << i;
    EXPECT_LT(between[i].rotation.angularDistance(between[0].rotation), 1e-9) << i;
  }
  EXPECT_LT((between[0].translation - second.translation).norm(), 2e-3);
  EXPECT_LT(between[0].rotation.angularDistance(second.rotation), 0.01);

  command.erase(command.begin() + 4);  // a photograph of the first camera: the rest can't be paired by counting
  const auto counts = lumihull({"calibrate", import("torn"), "--targets", "aruco:6x6_250:35mm", "--rig", "--quiet"});
  EXPECT_EQ(counts.status, 2);
  EXPECT_THAT(counts.err, HasSubstr("camera 0 has 7, camera 1 has 8"));
}

TEST_F(CalibrateVerb, SaysWhatIsWrong) {
  const std::string capture = import_photos();
  const auto unnamed = lumihull({"calibrate", capture});
  EXPECT_EQ(unnamed.status, 2);
  EXPECT_THAT(unnamed.err, HasSubstr("targets"));
  const auto no_word = lumihull({"calibrate", capture, "--targets", "aruco:9x9_1:35mm"});
  EXPECT_EQ(no_word.status, 2);
  EXPECT_THAT(no_word.err, HasSubstr("9x9_1"));
  const auto no_file = lumihull({"calibrate", capture, "--targets", (mine_ / "none.json").string()});
  EXPECT_EQ(no_file.status, 1);
  EXPECT_THAT(no_file.err, HasSubstr("none.json"));
  const auto other = lumihull({"calibrate", capture, "--targets", "apriltag:36h11:35mm", "--quiet"});
  EXPECT_EQ(other.status, 1);
  EXPECT_THAT(other.err, AllOf(HasSubstr("none of the 8 photographs"), HasSubstr("apriltag:36h11:35mm")));
  const auto guess =
      lumihull({"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--intrinsics", "fixed", "--quiet"});
  EXPECT_NE(guess.status, 0) << "a guess of the focal length is nothing to keep";
  const auto free = lumihull({"calibrate", capture, "--intrinsics", "refine", "--free", "f,x9", "--quiet"});
  EXPECT_EQ(free.status, 2);
  EXPECT_THAT(free.err, HasSubstr("x9"));
  EXPECT_EQ(lumihull({"calibrate", capture, "--model", "soft"}).status, 2);
  EXPECT_FALSE(Capture::open(capture).positioned(0));
  EXPECT_FALSE(fs::exists(fs::path(capture) / "targets.json"));
}

}  // namespace
}  // namespace lumihull
