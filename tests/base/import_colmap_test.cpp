#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>

#include <cstdlib>
#include <cstring>
#include <random>

#include "colmap_model.h"
#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using test::expect_error;

constexpr char kCameras[] =
    "# Camera list\n"
    "1 OPENCV 80 60 90.5 91 40.25 29.5 -0.08 0.01 0.0005 -0.0003\n"
    "7 SIMPLE_PINHOLE 40 30 50 20 15\n";
constexpr char kImages[] =
    "# Image list\n"
    "1 1 0 0 0 0.1 -0.2 5 1 left/a.png\n"
    "10.5 11.5 -1 20 21 4\n"
    "2 0.7071067811865476 0 0.7071067811865475 0 0 0 4 7 b.png\n"
    "\n"
    "5 0.5 0.5 0.5 0.5 1 2 3 1 right/a.png\n"
    "\n";

void write_photos(const fs::path& folder) {
  fs::create_directories(folder / "left");
  fs::create_directories(folder / "right");
  write_png(folder / "left" / "a.png", test::pattern(80, 60, 3));
  write_png(folder / "right" / "a.png", test::pattern(80, 60, 3));
  write_png(folder / "b.png", test::pattern(40, 30, 3));
}

Capture import_text(const test::TemporaryFolder& folder, const std::string& cameras, const std::string& images) {
  write_photos(folder / "photos");
  fs::create_directories(folder / "model");
  write_file(folder / "model/cameras.txt", cameras);
  write_file(folder / "model/images.txt", images);
  write_file(folder / "model/points3D.txt", "");
  Job job;
  RefitImportOptions options;
  options.output = folder / "capture";
  return import_colmap(folder / "model", folder / "photos", options, job);
}

TEST(ImportColmap, TextModel) {
  const test::TemporaryFolder folder;
  const Capture capture = import_text(folder, kCameras, kImages);
  ASSERT_EQ(capture.shots.size(), 3u);
  ASSERT_EQ(capture.cameras.size(), 2u);
  EXPECT_EQ(capture.shots[0].name, "a");
  EXPECT_EQ(capture.shots[2].name, "right_a");
  EXPECT_EQ(capture.shots[1].camera, 1);
  EXPECT_NEAR(capture.shots[2].cam_from_world->rotation.x(), 0.5, 1e-12);
  EXPECT_EQ(capture.shots[2].cam_from_world->translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(capture.cameras[1].f, 50);
  EXPECT_EQ(capture.cameras[1].u0, 20);
  ASSERT_EQ(capture.notes.size(), 1u);
  EXPECT_THAT(capture.notes[0], testing::HasSubstr("largest error"));
  // The refitted camera sees what COLMAP's does.
  internal::ColmapModel model;
  internal::parse_colmap_cameras_text(kCameras, "c", model);
  for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0, 0), {0.3, 0.2}, {-0.4, 0.3}})
    EXPECT_NEAR((*capture.cameras[0].project(ray.homogeneous()) - model.cameras.at(1).project(ray)).norm(), 0, 0.01);
}

template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string binary_cameras() {
  std::string out;
  put(out, std::uint64_t(2));
  put(out, std::uint32_t(1)), put(out, std::int32_t(4)), put(out, std::uint64_t(80)), put(out, std::uint64_t(60));
  for (const double p : {90.5, 91.0, 40.25, 29.5, -0.08, 0.01, 0.0005, -0.0003}) put(out, p);
  put(out, std::uint32_t(7)), put(out, std::int32_t(0)), put(out, std::uint64_t(40)), put(out, std::uint64_t(30));
  for (const double p : {50.0, 20.0, 15.0}) put(out, p);
  return out;
}

std::string binary_images() {
  std::string out;
  put(out, std::uint64_t(2));
  put(out, std::uint32_t(1));
  for (const double v : {1.0, 0.0, 0.0, 0.0, 0.1, -0.2, 5.0}) put(out, v);
  put(out, std::uint32_t(1));
  out += std::string("left/a.png") + '\0';
  put(out, std::uint64_t(1)), put(out, 10.5), put(out, 11.5), put(out, std::uint64_t(-1));
  put(out, std::uint32_t(2));
  for (const double v : {std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0, 0.0, 0.0, 4.0}) put(out, v);
  put(out, std::uint32_t(7));
  out += std::string("b.png") + '\0';
  put(out, std::uint64_t(0));
  return out;
}

TEST(ImportColmap, BinaryModelIsPreferredAndSaysTheSame) {
  const test::TemporaryFolder folder;
  fs::create_directories(folder / "model");
  write_file(folder / "model/cameras.bin", binary_cameras());
  write_file(folder / "model/images.bin", binary_images());
  const Capture capture = import_text(folder, "broken", "broken");
  ASSERT_EQ(capture.shots.size(), 2u);
  EXPECT_EQ(capture.shots[0].name, "a");
  EXPECT_EQ(capture.shots[0].cam_from_world->translation, Eigen::Vector3d(0.1, -0.2, 5));
  internal::ColmapModel text, binary;
  internal::parse_colmap_cameras_text(kCameras, "c", text);
  internal::parse_colmap_cameras_binary(binary_cameras(), "c", binary);
  for (const int id : {1, 7})
    EXPECT_EQ(text.cameras.at(id).project({0.2, -0.1}), binary.cameras.at(id).project({0.2, -0.1}));
}

TEST(ImportColmap, EveryCutOfABinaryFileIsAnError) {
  const std::string cameras = binary_cameras(), images = binary_images();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    internal::ColmapModel model;
    EXPECT_EQ(expect_error([&] { internal::parse_colmap_cameras_binary(cameras.substr(0, i), "c", model); }).code(),
              ErrorCode::bad_input);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    internal::ColmapModel model;
    EXPECT_EQ(expect_error([&] { internal::parse_colmap_images_binary(images.substr(0, i), "c", model); }).code(),
              ErrorCode::bad_input);
  }
  // Counts that no file can hold.
  for (const std::string* whole : {&cameras, &images}) {
    std::string hostile = *whole;
    hostile.replace(0, 8, 8, '\x7f');
    internal::ColmapModel model;
    EXPECT_EQ(expect_error([&] {
                whole == &cameras ? internal::parse_colmap_cameras_binary(hostile, "c", model)
                                  : internal::parse_colmap_images_binary(hostile, "c", model);
              }).code(),
              ErrorCode::bad_input);
  }
}

TEST(ImportColmap, WrongModelsAreErrorsThatNameTheLine) {
  const auto cameras = [](const std::string& text) {
    return expect_error([&] {
      internal::ColmapModel model;
      internal::parse_colmap_cameras_text(text, "cameras.txt", model);
    });
  };
  EXPECT_THAT(cameras("1 PINHOLE 80 60 90 90 40\n").what(), testing::HasSubstr("line 1: expected 4 parameters"));
  EXPECT_EQ(cameras("1 THIN_PRISM_FISHEYE 80 60 90 90 40 30 0 0 0 0 0 0 0 0\n").code(), ErrorCode::unsupported);
  EXPECT_THAT(cameras("1 PINHOLE 80 60 nan 90 40 30\n").what(), testing::HasSubstr("not a finite number"));
  EXPECT_THAT(cameras("1 PINHOLE 80 60 -90 90 40 30\n").what(), testing::HasSubstr("focal length"));
  EXPECT_THAT(cameras("1 PINHOLE 8e9 60 90 90 40 30\n").what(), testing::HasSubstr("65500"));
  EXPECT_THAT(cameras("1 PINHOLE 80 60 90 90 40 30\n1 PINHOLE 80 60 90 90 40 30\n").what(),
              testing::HasSubstr("line 2: a camera that was there"));
  const auto images = [](const std::string& text) {
    return expect_error([&] {
      internal::ColmapModel model;
      internal::parse_colmap_images_text(text, "images.txt", model);
      internal::check_colmap_model(model, "images.txt");
    });
  };
  EXPECT_THAT(images("1 1 0 0 0 0 0 5 1\n").what(), testing::HasSubstr("line 1: expected IMAGE_ID"));
  EXPECT_THAT(images("1 2 0 0 0 0 0 5 1 a.png\n\n").what(), testing::HasSubstr("unit length"));
  EXPECT_THAT(images("1 1 0 0 0 0 0 5 1 a.png\n\n").what(), testing::HasSubstr("names camera 1"));
  EXPECT_THAT(images("").what(), testing::HasSubstr("no images"));
  const test::TemporaryFolder folder;
  Job job;
  RefitImportOptions options;
  options.output = folder / "capture";
  EXPECT_EQ(expect_error([&] { import_colmap(folder.path(), folder.path(), options, job); }).code(),
            ErrorCode::not_found);
}

TEST(ImportColmap, APhotographOfAnotherSizeIsNamed) {
  const test::TemporaryFolder folder;
  const Error error =
      expect_error([&] { import_text(folder, "1 PINHOLE 81 60 90 90 40 30\n", "1 1 0 0 0 0 0 5 1 left/a.png\n\n"); });
  EXPECT_EQ(error.code(), ErrorCode::bad_input);
  EXPECT_THAT(error.subject(), testing::HasSubstr("a.png"));
  EXPECT_FALSE(fs::exists(folder / "capture"));
}

TEST(ExportColmap, TextToOursToTextKeepsCamerasAndPoses) {
  const test::TemporaryFolder folder;
  const std::string images =
      "1 1 0 0 0 0.1 -0.2 5 1 a.png\n\n2 0.7071067811865476 0 0.7071067811865475 0 0 0 4 7 b.png\n\n";
  write_png(folder / "a.png", test::pattern(80, 60, 3));
  fs::create_directories(folder / "photos");
  fs::copy_file(folder / "a.png", folder / "photos/a.png");
  const Capture capture = import_text(folder, kCameras, images);
  const ExportReport report = export_colmap(capture, folder / "out");
  EXPECT_EQ(report.photos, 2);
  EXPECT_LT(report.largest_refit_error_px, 0.05);
  internal::ColmapModel before, after;
  internal::parse_colmap_cameras_text(kCameras, "c", before);
  internal::parse_colmap_images_text(images, "i", before);
  internal::parse_colmap_cameras_text(read_file(folder / "out/cameras.txt"), "c", after);
  internal::parse_colmap_images_text(read_file(folder / "out/images.txt"), "i", after);
  ASSERT_EQ(after.images.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto &a = before.images[i], &b = after.images[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_TRUE(a.cam_from_world.matrix().isApprox(b.cam_from_world.matrix(), 1e-14));
    for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0, 0), {0.3, 0.2}, {-0.4, 0.3}})
      EXPECT_NEAR((before.cameras.at(a.camera).project(ray) - after.cameras.at(b.camera).project(ray)).norm(), 0, 0.02);
  }
  EXPECT_EQ(expect_error([&] { export_colmap(capture, folder / "out"); }).code(), ErrorCode::invalid_argument);

  // COLMAP itself reads it.
  if (std::system("colmap help > /dev/null 2>&1") != 0) GTEST_SKIP() << "colmap is not installed";
  fs::create_directories(folder / "converted");
  const std::string command = "colmap model_converter --input_path " + (folder / "out").string() + " --output_path " +
                              (folder / "converted").string() + " --output_type BIN > /dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  internal::ColmapModel colmap;
  internal::parse_colmap_cameras_binary(read_file(folder / "converted/cameras.bin"), "c", colmap);
  internal::parse_colmap_images_binary(read_file(folder / "converted/images.bin"), "i", colmap);
  ASSERT_EQ(colmap.images.size(), 2u);
  for (const auto& image : colmap.images) {
    const auto& ours = after.images[image.name == "a.png" ? 0 : 1];
    EXPECT_TRUE(image.cam_from_world.matrix().isApprox(ours.cam_from_world.matrix(), 1e-12));
    EXPECT_EQ(colmap.cameras.at(image.camera).project({0.2, 0.1}), after.cameras.at(ours.camera).project({0.2, 0.1}));
  }
}

TEST(ExportColmap, ASkewIsRefusedWithWhatIsLostAndAForeignPoseLessShotIsLeftOut) {
  const test::TemporaryFolder folder;
  Capture capture = Capture::create(folder / "capture");
  Camera camera;
  camera.width = 720;
  camera.height = 576;
  camera.f = 2300;
  camera.u0 = 290;
  camera.v0 = -1070;
  capture.cameras = {camera};
  Shot shot;
  shot.name = "a";
  shot.file = "photos/a.png";
  shot.cam_from_world = Pose();
  capture.shots = {shot};
  shot.name = "b";
  shot.file = "photos/b.png";
  shot.cam_from_world.reset();
  capture.shots.push_back(shot);
  const ExportReport report = export_colmap(capture, folder / "far");
  EXPECT_EQ(report.photos, 1);
  EXPECT_EQ(report.largest_refit_error_px, 0);  // a far principal point is no obstacle
  ASSERT_EQ(report.notes.size(), 1u);

  capture.cameras[0].skew = -78.6;
  for (const bool nerf : {false, true}) {
    const Error error = expect_error([&] {
      if (nerf)
        export_nerf(capture, folder / "transforms.json");
      else
        export_colmap(capture, folder / "skewed");
    });
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_THAT(error.message(), testing::HasSubstr("skew of -78.6"));
    EXPECT_THAT(error.message(), testing::HasSubstr(" px"));
  }
  EXPECT_FALSE(fs::exists(folder / "skewed"));
  EXPECT_FALSE(fs::exists(folder / "transforms.json"));
  capture.shots[0].cam_from_world.reset();
  EXPECT_EQ(expect_error([&] { export_colmap(capture, folder / "none"); }).code(), ErrorCode::bad_input);
}

}  // namespace
}  // namespace lumihull
