#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>

#include <cmath>

#include "nerf_json.h"
#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::expect_error;

// A camera at (0, -4, 0) that looks along +y, its up along +z: OpenGL's columns are right, up, backwards, position.
constexpr char kPose[] = "[[1,0,0,0],[0,0,-1,-4],[0,1,0,0],[0,0,0,1]]";

std::string one_frame(const std::string& top, const std::string& frame, const std::string& pose = kPose) {
  return "{" + top + "\"frames\":[{\"file_path\":\"./a\"," + frame + "\"transform_matrix\":" + pose + "}]}";
}

Image with_alpha() {
  Image image = test::pattern(80, 60, 4);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) image.row<std::uint8_t>(y)[4 * x + 3] = x < 40 ? 0 : x == 40 ? 128 : 255;
  return image;
}

Capture import_one(const test::TemporaryFolder& folder, const std::string& json) {
  write_file(folder / "transforms.json", json);
  Job job;
  RefitImportOptions options;
  options.output = folder / "capture";
  const std::vector<fs::path> files{folder / "transforms.json"};
  return import_nerf(files, options, job);
}

TEST(ImportNerf, OpenGlPosesAndFieldOfView) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", with_alpha());
  const Capture capture = import_one(folder, one_frame("\"camera_angle_x\":1.5707963267948966,", ""));
  ASSERT_EQ(capture.shots.size(), 1u);
  const View view = capture.view(0);
  EXPECT_TRUE(view.center().isApprox(Eigen::Vector3d(0, -4, 0), 1e-12));
  EXPECT_NEAR(view.camera.f, 40, 1e-9);
  const auto centre = view.project({0, 0, 0}), right = view.project({1, 0, 0}), up = view.project({0, 0, 1});
  ASSERT_TRUE(centre && right && up);
  EXPECT_NEAR((*centre - Eigen::Vector2d(40, 30)).norm(), 0, 1e-9);
  EXPECT_NEAR((*right - Eigen::Vector2d(50, 30)).norm(), 0, 1e-9);
  EXPECT_NEAR((*up - Eigen::Vector2d(40, 20)).norm(), 0, 1e-9);
}

TEST(ImportNerf, AlphaBecomesTheMask) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", with_alpha());
  const Capture capture = import_one(folder, one_frame("\"camera_angle_x\":0.7,", ""));
  EXPECT_EQ(capture.shots[0].mask_source, MaskSource::imported);
  EXPECT_EQ(capture.mask_state(capture.shots[0]), MaskSource::imported);
  const Image mask = capture.read_mask(0);
  EXPECT_EQ(mask.row<std::uint8_t>(5)[39], 0);
  EXPECT_EQ(mask.row<std::uint8_t>(5)[40], 128);
  EXPECT_EQ(mask.row<std::uint8_t>(5)[41], 255);
  ASSERT_TRUE(capture.background_rgb);
  EXPECT_EQ((*capture.background_rgb)[0], 255);
}

TEST(ImportNerf, AnOpaqueAlphaIsNoMask) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", converted(test::pattern(80, 60, 3), PixelType::u8, 4));
  const Capture capture = import_one(folder, one_frame("\"camera_angle_x\":0.7,", ""));
  EXPECT_EQ(capture.shots[0].mask_source, MaskSource::none);
  EXPECT_FALSE(capture.background_rgb);
}

TEST(ImportNerf, FramesOverrideTheFileAndSeveralFilesAreOneCapture) {
  const test::TemporaryFolder folder;
  for (const char* set : {"train", "test"}) {
    fs::create_directories(folder / set);
    for (const char* name : {"r_0.png", "r_1.png"}) write_png(folder / set / name, test::pattern(80, 60, 3));
    const std::string prefix = std::string("./") + set + "/r_";
    write_file(folder / (std::string("transforms_") + set + ".json"),
               std::string("{\"fl_x\":100,\"fl_y\":101,\"cx\":41,\"cy\":29,\"w\":80,\"h\":60,\"frames\":[") +
                   "{\"file_path\":\"" + prefix + "0\",\"transform_matrix\":" + kPose + "}," + "{\"file_path\":\"" +
                   prefix + "1.png\",\"fl_x\":120,\"k1\":-0.1,\"k2\":0.02,\"transform_matrix\":" + kPose + "}]}");
  }
  Job job;
  RefitImportOptions options;
  options.output = folder / "capture";
  const std::vector<fs::path> files{folder / "transforms_train.json", folder / "transforms_test.json"};
  const Capture capture = import_nerf(files, options, job);
  ASSERT_EQ(capture.shots.size(), 4u);
  ASSERT_EQ(capture.cameras.size(), 2u);
  EXPECT_EQ(capture.shots[0].name, "r_0");
  EXPECT_EQ(capture.shots[2].name, "test_r_0");
  EXPECT_EQ(capture.cameras[0].f, 101);
  EXPECT_NEAR(capture.cameras[0].s * 101, 100, 1e-12);
  EXPECT_EQ(capture.cameras[0].u0, 41);
  EXPECT_TRUE(capture.cameras[1].has_distortion());
  EXPECT_NEAR(capture.cameras[1].k1, 0.1, 0.03);  // the other direction
}

TEST(ImportNerf, WrongFilesNameTheJsonPointer) {
  const auto message = [](const std::string& text) {
    return std::string(expect_error([&] { internal::parse_nerf(text, "t.json"); }).what());
  };
  const auto pose = [](const std::string& p) { return one_frame("\"camera_angle_x\":1,", "", p); };
  EXPECT_THAT(message("{"), testing::HasSubstr("not valid JSON"));
  EXPECT_THAT(message("{}"), testing::HasSubstr("frames"));
  EXPECT_THAT(message("{\"frames\":[]}"), testing::HasSubstr("/frames"));
  EXPECT_THAT(message("{\"frames\":[{}]}"), testing::HasSubstr("/frames/0"));
  EXPECT_THAT(message(pose("[[1,0,0,0],[0,1,0,0],[0,0,2,0],[0,0,0,1]]")),
              testing::HasSubstr("/frames/0/transform_matrix: expected a rotation"));
  EXPECT_THAT(message(pose("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]")), testing::HasSubstr("rotation"));
  EXPECT_THAT(message(pose("[[1,0,0],[0,1,0],[0,0,1],[0,0,0]]")), testing::HasSubstr("/transform_matrix/0"));
  EXPECT_THAT(message(pose("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]")), testing::HasSubstr("/transform_matrix/3"));
  EXPECT_THAT(message(pose("[[1,0,0,\"x\"],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")),
              testing::HasSubstr("/transform_matrix/0/3"));
  EXPECT_THAT(message(one_frame("\"camera_angle_x\":4,", "")), testing::HasSubstr("/camera_angle_x"));
  EXPECT_THAT(message(one_frame("\"camera_model\":\"PANORAMA\",", "")), testing::HasSubstr("PANORAMA"));

  const test::TemporaryFolder folder;
  EXPECT_EQ(expect_error([&] { import_one(folder, one_frame("\"camera_angle_x\":1,", "")); }).code(),
            ErrorCode::not_found);
  write_png(folder / "a.png", test::pattern(80, 60, 3));
  EXPECT_THAT(expect_error([&] { import_one(folder, one_frame("", "")); }).what(), testing::HasSubstr("fl_x"));
  EXPECT_THAT(expect_error([&] { import_one(folder, one_frame("\"w\":81,\"camera_angle_x\":1,", "")); }).what(),
              testing::HasSubstr("w and h"));
}

TEST(ExportNerf, NerfToOursToNerfIsTheSame) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", test::pattern(80, 60, 3));
  const Capture capture = import_one(
      folder, one_frame("\"fl_x\":100,\"fl_y\":101,\"cx\":41,\"cy\":29,\"k1\":-0.1,\"k2\":0.02,\"p1\":0.001,", ""));
  const ExportReport report = export_nerf(capture, folder / "out.json");
  EXPECT_LT(report.largest_refit_error_px, 0.02);
  const auto frames = internal::parse_nerf(read_file(folder / "out.json"), "out.json");
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].file, "capture/photos/a.png");
  EXPECT_TRUE(frames[0].cam_from_world.matrix().isApprox(capture.shots[0].cam_from_world->matrix(), 1e-12));
  EXPECT_NEAR(*frames[0].intrinsics.fx, 100, 0.2);
  EXPECT_NEAR(frames[0].intrinsics.lens[0], -0.1, 0.02);
  Job job;
  RefitImportOptions options;
  options.output = folder / "again";
  const std::vector<fs::path> files{folder / "out.json"};
  const Capture again = import_nerf(files, options, job);
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 0, 0), {1, 0.3, -0.5}, {-1, 0, 1}})
    EXPECT_NEAR((*again.view(0).project(point) - *capture.view(0).project(point)).norm(), 0, 0.05);
}

}  // namespace
}  // namespace lumihull
