#include <lumihull/base/files.h>
#include <lumihull/base/import.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>

#include "import_common.h"
#include "picture_files.h"
#include "support.h"

namespace lumihull {
namespace {

namespace fs = std::filesystem;
using Matrix34 = Eigen::Matrix<double, 3, 4>;
using test::expect_error;

struct Listing {
  std::vector<Matrix34> matrices;
  std::vector<std::string> names;
};

std::string print(const Listing& listing) {
  std::string text = "# NAME p11 ... p34\n\n";
  for (std::size_t i = 0; i < listing.matrices.size(); ++i) {
    text += listing.names[i];
    for (int k = 0; k < 12; ++k) {
      char number[40];
      std::snprintf(number, sizeof number, " %.17g", listing.matrices[i](k / 4, k % 4));
      text += number;
    }
    text += i % 2 ? "\r\n" : "\n";
  }
  return text;
}

/// Cameras on a ring around an object that is not at the origin, with skew and a principal point far outside.
Listing ring(const fs::path& folder, bool mirrored, unsigned seed) {
  Listing listing;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Eigen::Matrix3d k;
  k << 90, -7, 30, 0, 70, -150, 0, 0, 1;
  const Eigen::Vector3d object(3, -2, 1);
  // The picture's centre (40, 30) looks along this direction of the camera: turn it to the axis.
  const Eigen::Vector3d sight = (k.inverse() * Eigen::Vector3d(40, 30, 1)).normalized();
  for (int i = 0; i < 7; ++i) {
    const double angle = 2 * M_PI * i / 7;
    const Eigen::Vector3d eye =
        object + Eigen::Vector3d(4 * std::cos(angle), 4 * std::sin(angle), 1 + 0.2 * unit(random));
    Pose pose = look_at(eye, object, Eigen::Vector3d::UnitZ());
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), sight);
    pose.rotation = turn * pose.rotation;
    pose.translation = turn * pose.translation;
    Matrix34 p = k * pose.matrix();
    if (mirrored) p.col(0) = -p.col(0);
    p *= (i % 2 ? -1 : 1) * std::pow(10, 6 * unit(random));
    listing.matrices.push_back(p);
    listing.names.push_back("p" + std::to_string(i) + ".png");
    write_png(folder / listing.names.back(), test::pattern(80, 60, 3));
  }
  return listing;
}

/// Largest distance of the capture's pixels from the matrices' pixels, relative to the pixel's length, over points near
/// the object. `mirror`: the capture's world has z reversed. `shift` is added to the matrices' pixels.
double largest_error(const Capture& capture, const Listing& listing, const Eigen::Vector3d& object, bool mirror,
                     double shift, double radius) {
  double worst = 0;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-radius, radius);
  for (std::size_t i = 0; i < listing.matrices.size(); ++i)
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d x = object + Eigen::Vector3d(unit(random), unit(random), unit(random));
      const Eigen::Vector2d expected =
          (listing.matrices[i] * x.homogeneous()).hnormalized() + Eigen::Vector2d(shift, shift);
      const Eigen::Vector3d ours(x.x(), x.y(), mirror ? -x.z() : x.z());
      const auto pixel = capture.view(i).project(ours);
      if (!pixel) return INFINITY;
      worst = std::max(worst, (*pixel - expected).norm() / std::max(1.0, expected.norm()));
    }
  return worst;
}

bool has_note(const Capture& capture, const std::string& part) {
  for (const std::string& note : capture.notes)
    if (note.find(part) != std::string::npos) return true;
  return false;
}

TEST(ImportProjections, AnyScaleAndSignProjectTheSamePoints) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const test::TemporaryFolder folder;
    const Listing listing = ring(folder.path(), false, seed);
    write_file(folder / "P.txt", print(listing));
    Job job;
    ProjectionImportOptions options;
    options.output = folder / "capture";
    const Capture capture = import_projections(folder / "P.txt", options, job);
    ASSERT_EQ(capture.shots.size(), 7u);
    EXPECT_EQ(capture.shots[2].name, "p2");
    EXPECT_EQ(capture.shots[2].file, "photos/p2.png");
    EXPECT_EQ(capture.unit, Unit::unknown);
    EXPECT_EQ(capture.cameras.size(), 1u);
    EXPECT_FALSE(has_note(capture, "mirrored"));
    EXPECT_NEAR(capture.cameras[0].skew, -7, 1e-9);
    EXPECT_NEAR(capture.cameras[0].v0, -150, 1e-8);
    EXPECT_LT(largest_error(capture, listing, {3, -2, 1}, false, 0, 0.5), 1e-9);
    EXPECT_EQ(capture.read_photo(3).width(), 80);
    EXPECT_EQ(Capture::open(folder / "capture").shots.size(), 7u);
  }
}

TEST(ImportProjections, ALeftHandedWorldIsMirroredAndSaid) {
  const test::TemporaryFolder folder;
  const Listing listing = ring(folder.path(), true, 3);
  write_file(folder / "P.txt", print(listing));
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "capture";
  const Capture capture = import_projections(folder / "P.txt", options, job);
  EXPECT_TRUE(has_note(capture, "left-handed"));
  EXPECT_LT(largest_error(capture, listing, {-3, -2, 1}, true, 0, 0.5), 1e-9);
}

TEST(ImportProjections, TheFirstPixelsCentreIsAnOption) {
  const test::TemporaryFolder folder;
  const Listing listing = ring(folder.path(), false, 4);
  write_file(folder / "P.txt", print(listing));
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "capture";
  options.first_pixel_center = 0;
  const Capture capture = import_projections(folder / "P.txt", options, job);
  EXPECT_LT(largest_error(capture, listing, {3, -2, 1}, false, 0.5, 0.5), 1e-9);
  EXPECT_TRUE(has_note(capture, "0.5"));
}

TEST(ImportProjections, MixedHandednessNamesThePhotographs) {
  const test::TemporaryFolder folder;
  Listing listing = ring(folder.path(), false, 5);
  // Mirrored about a plane through the object: it still looks there.
  Eigen::Matrix4d mirror = Eigen::Matrix4d::Identity();
  mirror(0, 0) = -1;
  mirror(0, 3) = 6;
  listing.matrices[4] = listing.matrices[4] * mirror;
  write_file(folder / "P.txt", print(listing));
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "capture";
  const Error error = expect_error([&] { import_projections(folder / "P.txt", options, job); });
  EXPECT_EQ(error.code(), ErrorCode::bad_input);
  EXPECT_THAT(error.message(), testing::HasSubstr("p4.png would be left-handed"));
  EXPECT_FALSE(fs::exists(folder / "capture"));
}

TEST(ImportProjections, WrongLinesAreNamed) {
  const auto message = [](const std::string& text) {
    return std::string(expect_error([&] { internal::parse_projections(text, "P.txt"); }).what());
  };
  const std::string good = "a.png 1 0 0 0 0 1 0 0 0 0 1 5\n";
  EXPECT_THAT(message(good + "b.png 1 0 0 0 0 1 0 0 0 0 1\n"),
              testing::HasSubstr("line 2: expected a photograph's name"));
  EXPECT_THAT(message(good + "b.png 1 0 0 0 0 1 0 0 0 0 1 5 6\n"),
              testing::HasSubstr("line 2: expected a photograph's"));
  EXPECT_THAT(message("# a\n\nb.png 1 0 0 0 0 nan 0 0 0 0 1 5\n"), testing::HasSubstr("line 3: value 6"));
  EXPECT_THAT(message("b.png 1 0 0 0 0 1e999 0 0 0 0 1 5\n"), testing::HasSubstr("line 1: value 6"));
  EXPECT_THAT(message("b.png 1 0 0 0 0 1,5 0 0 0 0 1 5\n"), testing::HasSubstr("line 1: value 6"));
  EXPECT_THAT(message("b.png 0 0 0 0 0 0 0 0 0 0 0 0\n"), testing::HasSubstr("line 1: the matrix is singular"));
  EXPECT_THAT(message("b.png 1 2 3 0 2 4 6 0 0 0 1 5\n"), testing::HasSubstr("line 1: the matrix is singular"));
  EXPECT_THAT(message("# nothing\n"), testing::HasSubstr("found none"));
  EXPECT_EQ(internal::parse_projections("my photo 1.png 1 0 0 0 0 1 0 0 0 0 1 +5", "P.txt")[0].name, "my photo 1.png");
}

TEST(ImportProjections, ParallelRaysAreDegenerateAndOneCameraIsNot) {
  const test::TemporaryFolder folder;
  write_png(folder / "a.png", test::pattern(80, 60, 3));
  write_png(folder / "b.png", test::pattern(80, 60, 3));
  write_file(folder / "P.txt", "a.png 90 0 40 0 0 90 30 0 0 0 1 5\nb.png 90 0 40 90 0 90 30 0 0 0 1 5\n");
  write_file(folder / "one.txt", "a.png -90 0 -40 0 0 -90 -30 0 0 0 -1 -5\n");
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "capture";
  EXPECT_EQ(expect_error([&] { import_projections(folder / "P.txt", options, job); }).code(), ErrorCode::degenerate);
  const Capture capture = import_projections(folder / "one.txt", options, job);
  EXPECT_NEAR(capture.shots[0].cam_from_world->translation.z(), 5, 1e-12);
}

TEST(ImportProjections, AFailedImportLeavesNothingAndACaptureIsNeverOverwritten) {
  const test::TemporaryFolder folder;
  const Listing listing = ring(folder.path(), false, 6);
  write_file(folder / "P.txt", print(listing));
  ProjectionImportOptions options;
  options.output = folder / "capture";
  const auto entries = [&] {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path())) ++count;
    return count;
  };
  const std::size_t before = entries();
  Job cancelled;
  cancelled.cancel();
  EXPECT_EQ(expect_error([&] { import_projections(folder / "P.txt", options, cancelled); }).code(),
            ErrorCode::cancelled);
  EXPECT_EQ(entries(), before);

  // Damaged after its header: found while copying is not asked for, but a file that vanished is.
  fs::rename(folder / "p3.png", folder / "hidden");
  Job job;
  const Error error = expect_error([&] { import_projections(folder / "P.txt", options, job); });
  EXPECT_EQ(error.code(), ErrorCode::not_found);
  EXPECT_THAT(error.subject(), testing::HasSubstr("p3.png"));
  EXPECT_EQ(entries(), before);
  fs::rename(folder / "hidden", folder / "p3.png");

  fs::create_directory(folder / "capture");  // empty: allowed
  import_projections(folder / "P.txt", options, job);
  EXPECT_EQ(entries(), before + 1);
  const std::string was = read_file(folder / "capture" / "capture.json");
  EXPECT_EQ(expect_error([&] { import_projections(folder / "P.txt", options, job); }).code(),
            ErrorCode::invalid_argument);
  EXPECT_EQ(read_file(folder / "capture" / "capture.json"), was);
}

TEST(ImportProjections, ReferencesStayWhereTheyAre) {
  const test::TemporaryFolder folder;
  const Listing listing = ring(folder.path(), false, 7);
  write_file(folder / "P.txt", print(listing));
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "capture";
  options.reference = true;
  const Capture capture = import_projections(folder / "P.txt", options, job);
  EXPECT_EQ(capture.shots[0].file, fs::canonical(folder / "p0.png").string());
  EXPECT_FALSE(fs::exists(folder / "capture" / "photos"));
  EXPECT_EQ(capture.read_photo(0).width(), 80);
}

TEST(ImportProjections, TheHannoverDinosaur) {
  LUMIHULL_NEED_REAL_DATA(data, "dinosaur");
  Listing listing;
  std::istringstream text(read_file(data / "P.txt"));
  std::string name;
  while (text >> name) {
    Matrix34 p;
    for (int k = 0; k < 12; ++k) text >> p(k / 4, k % 4);
    listing.matrices.push_back(p);
    listing.names.push_back(name);
  }
  ASSERT_EQ(listing.matrices.size(), 36u);
  const test::TemporaryFolder folder;
  Job job;
  ProjectionImportOptions options;
  options.output = folder / "dino";
  options.reference = true;
  const Capture capture = import_projections(data / "P.txt", options, job);
  EXPECT_TRUE(has_note(capture, "left-handed"));
  EXPECT_LT(largest_error(capture, listing, {0, 0, -0.658}, true, 0, 0.1), 1e-9);
  EXPECT_NEAR(capture.cameras[0].skew, -78.6, 0.1);
  EXPECT_NEAR(capture.cameras[0].v0, -1070, 1);
  for (std::size_t i = 0; i < 36; ++i) EXPECT_EQ(capture.view(i).camera.width, 720);
}

TEST(ImportMiddlebury, TheTempleProjectsAsItsFileSays) {
  LUMIHULL_NEED_REAL_DATA(data, "temple");
  const test::TemporaryFolder folder;
  Job job;
  ImportOptions options;
  options.output = folder / "temple";
  const Capture capture = import_middlebury(data / "templeSR_par.txt", options, job);
  ASSERT_EQ(capture.shots.size(), 16u);
  EXPECT_EQ(capture.cameras.size(), 1u);
  EXPECT_EQ(capture.unit, Unit::unknown);
  const auto lines = internal::parse_middlebury(read_file(data / "templeSR_par.txt"), "par");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::size_t i = 0; i < 16; ++i)
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d x(-0.073568 + 0.1 * unit(random), 0.021728 + 0.16 * unit(random),
                              -0.012445 + 0.07 * unit(random));
      const Eigen::Vector2d expected = (lines[i].k * (lines[i].r * x + lines[i].t)).hnormalized();
      const auto pixel = capture.view(i).project(x);
      ASSERT_TRUE(pixel);
      EXPECT_NEAR((*pixel - expected - Eigen::Vector2d(0.5, 0.5)).norm(), 0, 1e-6);
      EXPECT_TRUE(capture.cameras[0].contains(*pixel));
    }
}

TEST(ImportMiddlebury, WrongFilesAreErrors) {
  const auto message = [](const std::string& text) {
    return std::string(expect_error([&] { internal::parse_middlebury(text, "par.txt"); }).what());
  };
  const std::string line = "a.png 100 0 40 0 100 30 0 0 1 1 0 0 0 1 0 0 0 1 0 0 5\n";
  EXPECT_EQ(internal::parse_middlebury("1\n" + line, "par.txt").size(), 1u);
  EXPECT_THAT(message("2\n" + line), testing::HasSubstr("promises 2 photographs, the file has 1"));
  EXPECT_THAT(message(line), testing::HasSubstr("line 1: expected the number"));
  EXPECT_THAT(message(""), testing::HasSubstr("empty"));
  EXPECT_THAT(message("1e300\n"), testing::HasSubstr("line 1"));
  EXPECT_THAT(message("1\na.png 100 0 40 0 100 30 0 0 1 1 0 0 0 1 0 0 0 -1 0 0 5\n"),
              testing::HasSubstr("line 2: R is not"));
  EXPECT_THAT(message("1\na.png 100 0 40 0 -100 30 0 0 1 1 0 0 0 1 0 0 0 1 0 0 5\n"),
              testing::HasSubstr("line 2: K is not"));
  EXPECT_THAT(message("1\na.png 100 0 40 0 inf 30 0 0 1 1 0 0 0 1 0 0 0 1 0 0 5\n"),
              testing::HasSubstr("line 2: number 5"));
  EXPECT_THAT(message("1\na.png 1 2\n"), testing::HasSubstr("line 2: expected"));
}

}  // namespace
}  // namespace lumihull
