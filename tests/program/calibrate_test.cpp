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
    const calib::TargetSet set = calib::TargetSet::from_word("aruco:6x6_250:35mm");
    std::vector<rig::FlatPrint> prints;
    for (int i = 0; i < 5; ++i) {
      prints.push_back(rig::print_of(set.designs[0], 10 + i));
      prints.back().world_from_print = {Eigen::Quaterniond(0, 1, 0, 0),
                                        {0.07 * std::cos(1.3 * i), 0.07 * std::sin(1.3 * i), 0}};
    }
    for (int i = 0; i < kPhotos; ++i) {
      const double turn = 2 * std::numbers::pi * i / kPhotos;
      View view;
      view.camera = {.width = 480, .height = 360, .f = 560, .u0 = 240, .v0 = 180};
      view.cam_from_world = look_at({.2 * std::cos(turn), .2 * std::sin(turn), i % 2 ? .2 : .3}, {0, 0, 0}, {0, 0, 1});
      write_png(*folder_ / ("photo" + std::to_string(i) + ".png"),
                rig::photograph_prints(view, prints, {.3f, .3f, .3f}, {.blur_px = .7, .noise_read = .004},
                                       std::uint64_t(i)));
    }
  }
  static void TearDownTestSuite() { delete folder_; }
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
  const auto outcome =
      lumihull({"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--json", "--quiet"});
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
  const auto with = lumihull({"run", capture, "--targets", "aruco:6x6_250:35mm", "--background", "enclosure", "--quiet"});
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
  const auto asked = lumihull(
      {"calibrate", folder, "--targets", "aruco:6x6_250:35mm", "--intrinsics", "fixed", "--quiet"});
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
  const auto guess = lumihull(
      {"calibrate", capture, "--targets", "aruco:6x6_250:35mm", "--intrinsics", "fixed", "--quiet"});
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
