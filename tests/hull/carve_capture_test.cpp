#include <lumihull/base/files.h>
#include <lumihull/hull/carve_capture.h>
#include <lumihull/hull/mesh_check.h>
#include <support.h>

#include <algorithm>
#include <filesystem>

#include "synthetic.h"

namespace lumihull {
namespace {

using namespace hull;

class CarveCapture : public testing::Test {
 protected:
  CarveCapture() : capture(Capture::create(folder / "capture")) {
    const auto views = test::views_around(test::pinhole(110, 100, 130), 14, 4);
    const auto object = test::sphere({0.2, 0, 0}, 0.9);
    capture.cameras.push_back(views[0].camera);
    for (std::size_t i = 0; i < views.size(); ++i) {
      Shot shot;
      shot.name = "shot_" + std::to_string(i);
      shot.file = "photos/" + shot.name + ".png";
      shot.cam_from_world = views[i].cam_from_world;
      capture.shots.push_back(shot);
    }
    capture.shots[4].cam_from_world.reset();
    capture.set_hold_out(7);  // shots 0 and 7
    for (std::size_t i = 0; i < views.size(); ++i)
      if (i != 0 && i != 4 && i != 7) capture.write_mask(i, test::mask_of(object, views[i]), MaskSource::imported);
  }

  test::TemporaryFolder folder;
  Capture capture;
  Job job;
};

TEST_F(CarveCapture, CarvesWithPositionedShotsThatAreNotHeldOut) {
  HullStageOptions options;
  options.resolution = 48;
  const HullReport report = carve_capture(capture, options, job);
  EXPECT_EQ(report.photographs, 11u);
  EXPECT_TRUE(report.warnings.empty());
  const Mesh mesh = read_mesh(capture.hull_path());
  EXPECT_TRUE(check_mesh(mesh).good());
  EXPECT_EQ(mesh.triangles.size(), report.triangles);
  EXPECT_NEAR(report.volume, 3.1, 0.4);
  EXPECT_GE(report.statistics.least_band_voxels, 1.75);

  options.max_triangles = 1000;
  const HullReport simple = carve_capture(capture, options, job);
  EXPECT_LE(simple.triangles, 1000u);
  EXPECT_EQ(simple.triangles_carved, report.triangles);
  EXPECT_GT(simple.simplification_error, 0);
}

TEST_F(CarveCapture, LeavesEmptyAndFullMasksOutAndSaysSo) {
  Image mask(110, 100, 1);
  capture.write_mask(2, mask, MaskSource::imported);
  std::fill_n(mask.row<std::uint8_t>(0), 11000, std::uint8_t(255));
  capture.write_mask(9, mask, MaskSource::imported);
  HullStageOptions options;
  options.resolution = 32;
  const HullReport report = carve_capture(capture, options, job);
  EXPECT_EQ(report.photographs, 9u);
  ASSERT_EQ(report.warnings.size(), 2u);
  EXPECT_THAT(report.warnings[0], testing::HasSubstr("shot_2: its mask is empty"));
  EXPECT_THAT(report.warnings[1], testing::HasSubstr("shot_9: its mask is full"));
}

TEST_F(CarveCapture, ErrorsNameThePhotographAndLeaveTheOldHull) {
  HullStageOptions options;
  options.resolution = 32;
  carve_capture(capture, options, job);
  const std::string before = sha256_of_file(capture.hull_path());
  std::filesystem::remove(capture.mask_path(capture.shots[5]));
  const Error missing = test::expect_error([&] { carve_capture(capture, options, job); });
  EXPECT_EQ(missing.code(), ErrorCode::not_found);
  EXPECT_THAT(missing.subject(), testing::HasSubstr("shot_5"));
  write_png(capture.mask_path(capture.shots[5]), Image(50, 100, 1));
  const Error size = test::expect_error([&] { carve_capture(capture, options, job); });
  EXPECT_EQ(size.code(), ErrorCode::bad_input);
  EXPECT_THAT(size.subject(), testing::HasSubstr("shot_5"));
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (i != 4) capture.write_mask(i, Image(110, 100, 1), MaskSource::imported);
  EXPECT_EQ(test::expect_error([&] { carve_capture(capture, options, job); }).code(), ErrorCode::degenerate);
  capture.options["evaluate"]["hold_out"] = std::int64_t(1);
  EXPECT_THAT(test::expect_error([&] { carve_capture(capture, options, job); }).message(),
              testing::HasSubstr("13 of 14 have poses, and 13 of these are held out"));
  capture.set_hold_out(0);
  capture.shots.resize(1);
  EXPECT_THAT(test::expect_error([&] { carve_capture(capture, options, job); }).message(),
              testing::HasSubstr("1 of 1 have poses, and 0 of these are held out"));
  capture.shots[0].cam_from_world.reset();
  const Error lost = test::expect_error([&] { carve_capture(capture, options, job); });
  EXPECT_EQ(lost.code(), ErrorCode::degenerate);
  EXPECT_THAT(lost.message(), testing::HasSubstr("none has a pose: import cameras"));
  EXPECT_EQ(sha256_of_file(capture.hull_path()), before);
}

}  // namespace
}  // namespace lumihull
