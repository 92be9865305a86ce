#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/hull/auto_key.h>
#include <lumihull/rig/rig_capture.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

namespace fs = std::filesystem;

RigOptions small() {
  RigOptions o;
  o.object = "box";
  o.size_m = .3;
  o.photos = 4, o.empty_photos = 2;
  o.width = 90;
  o.light = test::coarse_light();
  return o;
}

TEST(RigCapture, IsACaptureWithTruthBeside) {
  const test::TemporaryFolder folder;
  Job job;
  make_capture(folder / "box", small(), job);
  const Capture capture = Capture::open(folder / "box");
  ASSERT_EQ(capture.shots.size(), 4u);
  EXPECT_EQ(capture.enclosure.size(), 2u);
  EXPECT_EQ(capture.unit, Unit::metres);
  ASSERT_EQ(capture.cameras.size(), 1u);
  EXPECT_TRUE(capture.cameras[0].has_distortion());
  const hull::Mesh mesh = hull::read_mesh(folder / "box" / "truth" / "mesh.ply");
  for (std::size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(i);
    const Image photo = capture.read_photo(i);
    const Image mask = read_image(folder / "box" / "truth" / "masks" / (capture.shots[i].name + ".png"));
    ASSERT_EQ(mask.width(), 90);
    // The box's corners, projected through the lens, bound the mask to a pixel.
    Eigen::Array4d bounds(1e9, 1e9, -1e9, -1e9);
    for (const auto& v : mesh.vertices) {
      const auto px = capture.view(i).project(v.cast<double>());
      ASSERT_TRUE(px);
      bounds << bounds.head<2>().min(px->array()), bounds.tail<2>().max(px->array());
    }
    Eigen::Array4i seen(1 << 20, 1 << 20, -1, -1);
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        if (mask.row<std::uint8_t>(y)[x] > 0)
          seen << std::min(seen[0], x), std::min(seen[1], y), std::max(seen[2], x + 1), std::max(seen[3], y + 1);
    EXPECT_LT((seen.cast<double>() - bounds).abs().maxCoeff(), 1.3) << seen.transpose() << " / " << bounds.transpose();
  }
  EXPECT_EQ(read_image_info(capture.photo_path(capture.shots[1])).time, capture.shots[1].time);
  EXPECT_EQ(capture.shots[1].time, "2007-08-01T09:00:10");
}

TEST(RigCapture, TheSameOptionsMakeTheSameBytes) {
  const test::TemporaryFolder folder;
  Job one({}, 1), two({}, 2);
  RigOptions o = small();
  o.format = PhotoFormat::png;
  o.photo.reduce = 3;
  o.test_views = 2;
  make_capture(folder / "a", o, one);
  make_capture(folder / "b", o, two);
  std::size_t compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "a")) {
    const auto name = fs::relative(entry.path(), folder / "a");
    if (!entry.is_regular_file() || name == "capture.json") continue;  // that one holds the files' times
    EXPECT_EQ(read_file(entry.path()), read_file(folder / "b" / name)) << name;
    ++compared;
  }
  // Photographs, enclosure, masks; two cameras.json, mesh.ply, highlights.json; test views, masks, without highlights,
  // highlights alone, their two files.
  EXPECT_EQ(compared, 4u + 2 + 4 + 4 + 2 + 2 + 2 + 2 + 2);
}

/// Masks are in the sensor's rows and columns, however the camera was held.
TEST(RigCapture, OrientationTagsChangeNoMask) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o = small();
  o.width = 240, o.empty_photos = 4;
  make_capture(folder / "flat", o, job);
  fs::copy(folder / "flat", folder / "held", fs::copy_options::recursive);
  const std::string upright("\x12\x01\x03\x00\x01\x00\x00\x00\x01\x00", 10);  // the directory's entry
  std::vector<fs::path> files, enclosure;
  for (const char* from : {"photos", "enclosure"})
    for (const auto& entry : fs::directory_iterator(folder / "held" / from)) {
      std::string bytes = read_file(entry.path());
      const std::size_t at = bytes.find(upright);
      ASSERT_NE(at, std::string::npos);
      bytes[at + 8] = files.size() % 2 ? 8 : 6;
      write_file(entry.path(), bytes);
      (from[0] == 'p' ? files : enclosure).push_back(entry.path());
    }
  std::sort(files.begin(), files.end());
  const Capture imported = import_photos(files, {.output = folder / "imported"}, job);
  Capture flat = Capture::open(folder / "flat"), held = Capture::open(folder / "held");
  held.refresh_stamps(job);
  hull::key_capture(flat, {}, job);
  hull::key_capture(held, {}, job);
  for (std::size_t i = 0; i < flat.shots.size(); ++i) {
    const Image mask = flat.read_mask(i);
    EXPECT_TRUE(test::same_bytes(mask, held.read_mask(i))) << i;
    EXPECT_TRUE(test::same_bytes(flat.read_photo(i), imported.read_photo(i))) << i;
    EXPECT_TRUE(imported.shots[i].orientation == 6 || imported.shots[i].orientation == 8);
    EXPECT_EQ(imported.cameras[std::size_t(imported.shots[i].camera)].width, 240);
    std::size_t object = 0;
    for (int y = 0; y < mask.height(); ++y)
      object += std::size_t(std::count_if(mask.row<std::uint8_t>(y), mask.row<std::uint8_t>(y) + mask.width(),
                                          [](std::uint8_t m) { return m > 127; }));
    EXPECT_GT(object, 1000u) << "nothing was keyed";
  }
}

TEST(RigCapture, PlainFilesListTheirMatrices) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o = small();
  EXPECT_EQ(test::expect_error([&] { make_photographs(folder / "p", o, job); }).code(), ErrorCode::invalid_argument);
  o.distortion = false;
  o.path = Path::ring;
  make_photographs(folder / "p", o, job);
  make_capture(folder / "c", o, job);
  const Capture capture = Capture::open(folder / "c");
  std::istringstream lines(read_file(folder / "p" / "P.txt"));
  for (std::size_t i = 0; i < 4; ++i) {
    std::string name;
    Eigen::Matrix<double, 3, 4> p;
    ASSERT_TRUE(lines >> name);
    for (int k = 0; k < 12; ++k) ASSERT_TRUE(lines >> p(k / 4, k % 4));
    EXPECT_EQ(read_file(folder / "p" / name), read_file(capture.photo_path(capture.shots[i])));
    const Eigen::Vector3d point(.05, -.08, .11);
    const Eigen::Vector2d expected = *capture.view(i).project(point);
    EXPECT_LT(((p * point.homogeneous()).hnormalized() - expected).norm(), 1e-9);
  }
  EXPECT_EQ(test::expect_error([&] { make_photographs(folder / "p", o, job); }).code(), ErrorCode::invalid_argument);
}

TEST(RigCapture, CancelledOnesAreNoCapture) {
  const test::TemporaryFolder folder;
  Job job;
  job.cancel();
  EXPECT_EQ(test::expect_error([&] { make_capture(folder / "x", small(), job); }).code(), ErrorCode::cancelled);
  EXPECT_FALSE(fs::exists(folder / "x" / "capture.json"));
}

TEST(RigCapture, OptionsAreChecked) {
  const test::TemporaryFolder folder;
  Job job;
  for (const auto& spoil : {+[](RigOptions& o) { o.photos = 0; }, +[](RigOptions& o) { o.width = 3; },
                            +[](RigOptions& o) { o.size_m = NAN; }, +[](RigOptions& o) { o.fill = 2; },
                            +[](RigOptions& o) { o.jpeg_quality = 0; }, +[](RigOptions& o) { o.test_views = -1; },
                            +[](RigOptions& o) { o.object = "nothing"; }}) {
    RigOptions o = small();
    spoil(o);
    EXPECT_EQ(test::expect_error([&] { make_capture(folder / "x", o, job); }).code(), ErrorCode::invalid_argument);
  }
  RigOptions crowded = small();
  crowded.targets = true, crowded.target_px = 500;
  const Error error = test::expect_error([&] { make_photographs(folder / "y", crowded, job); });
  EXPECT_EQ(error.subject(), "sheets");
  EXPECT_THAT(error.message(), testing::HasSubstr("smaller circles"));
  EXPECT_FALSE(fs::exists(folder / "y")) << "what can't be is said before anything is made";
}

TEST(Trajectory, LooksAtItsTargetFromItsRadius) {
  Hemisphere h;
  h.target = {.1, -.2, .3};
  h.radius = 2;
  h.jitter = 0;
  for (const auto& poses : {hemisphere_trajectory(48, h), ring_trajectory(7, h), random_trajectory(20, h),
                            arc_trajectory(9, h, -1), arc_trajectory(1, h, 0)})
    for (const Pose& pose : poses) {
      EXPECT_NEAR((pose.center() - h.target).norm(), 2, 1e-9);
      EXPECT_LT((pose * h.target - Eigen::Vector3d(0, 0, 2)).norm(), 1e-9);
      const double phi = std::acos((pose.center() - h.target).z() / 2);
      EXPECT_GE(phi, h.phi_first - 1e-9);
      EXPECT_LE(phi, h.phi_last + 1e-9);
    }
  // Upright pictures: what is above the target is above it in the picture (random views are rolled).
  for (const Pose& pose : hemisphere_trajectory(600, h))
    EXPECT_LT((pose * (h.target + Eigen::Vector3d(0, 0, .1))).y(), 0);
  EXPECT_EQ(hemisphere_trajectory(600, h).size(), 600u);
  EXPECT_EQ(hemisphere_trajectory(601, h).size(), 601u);
  EXPECT_EQ(hemisphere_trajectory(1, h).size(), 1u);
  EXPECT_EQ(test::expect_error([&] { ring_trajectory(0, h); }).code(), ErrorCode::invalid_argument);
}

TEST(Trajectory, AnArcIsSmoothAndCrossesTheMiddle) {
  Hemisphere h;
  h.target = {.1, -.2, .3};
  h.jitter = 0;
  const auto poses = arc_trajectory(41, h, .7);
  ASSERT_EQ(poses.size(), 41u);
  const auto eye = [&](std::size_t i) { return Eigen::Vector3d(poses[i].center() - h.target); };
  double length = 0, longest = 0, bend = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double step = (eye(i) - eye(i - 1)).norm();
    length += step, longest = std::max(longest, step);
    if (i > 1) bend = std::max(bend, (eye(i) - 2 * eye(i - 1) + eye(i - 2)).norm());
  }
  EXPECT_GT(length, 1.5);  // radii
  EXPECT_LT(longest, 2 * length / 40);
  EXPECT_LT(bend, .3 * length / 40);
  EXPECT_NEAR(std::acos(eye(20).z()), (h.phi_first + h.phi_last) / 2, 1e-9);
  EXPECT_NEAR(std::atan2(eye(20).y(), eye(20).x()), .7, 1e-9);
}

TEST(Trajectory, FramingFillsTheSmallerSide) {
  const Camera camera = default_camera(900, false);
  const double distance = framing_distance(camera, .25, .8);
  // The ball's outline seen from there: half-angle asin(r / d).
  EXPECT_NEAR(2 * camera.f * std::tan(std::asin(.25 / distance)), .8 * camera.height, 1e-6);
}

}  // namespace
}  // namespace lumihull::rig
