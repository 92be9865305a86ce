// A capture's folder, from photographs to poses: what is stored, kept and taken up again.
#include <lumihull/base/files.h>
#include <lumihull/base/import.h>
#include <lumihull/calib/calibrate_capture.h>
#include <lumihull/calib/target_tracks.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>

#include "printed_scene.h"
#include "support.h"

namespace lumihull::calib {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::vector<std::optional<Pose>> poses_of(const Capture& capture) {
  std::vector<std::optional<Pose>> poses;
  for (const Shot& shot : capture.shots) poses.push_back(shot.cam_from_world);
  return poses;
}

class CalibrateCapture : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder();
    scene_ = new test::PrintedScene(test::print_scene(folder_->path()));
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete folder_;
  }
  /// A new capture of the photographs.
  Capture imported() {
    Job job;
    ImportOptions options;
    options.output = mine_ / "capture";
    return import_photos(scene_->photos, options, job);
  }
  static CalibrateCaptureOptions options() {
    CalibrateCaptureOptions o;
    o.targets = "matrix5x5:18mm";
    return o;
  }
  static inline test::TemporaryFolder* folder_ = nullptr;
  static inline test::PrintedScene* scene_ = nullptr;
  test::TemporaryFolder mine_;
  Job job_;
};

TEST_F(CalibrateCapture, PlacesEveryPhotographAndKeepsWhatItKnows) {
  Capture capture = imported();
  ASSERT_EQ(capture.notes.size(), 1u) << "import says that f is a guess";
  const CalibrateCaptureReport report = calibrate_capture(capture, options(), job_);
  EXPECT_GE(report.found, 40u);
  EXPECT_EQ(report.kept, 0u);
  for (std::size_t i = 0; i < capture.shots.size(); ++i) EXPECT_TRUE(capture.positioned(i)) << i;
  EXPECT_LT(scene_->center_error_m(poses_of(capture)), 5e-4);
  EXPECT_NEAR(capture.cameras[0].f, scene_->camera.f, 2);
  EXPECT_EQ(capture.unit, Unit::metres);
  EXPECT_TRUE(capture.notes.empty()) << "f is a guess no longer";

  const Capture again = Capture::open(capture.folder());
  EXPECT_LT(scene_->center_error_m(poses_of(again)), 5e-4);
  ASSERT_TRUE(again.camera_covariances.contains(0));
  EXPECT_GT(again.camera_covariances.at(0)(0, 0), 0);
  EXPECT_EQ(again.camera_covariances.at(0), capture.camera_covariances.at(0));
  for (const Shot& shot : again.shots) {
    ASSERT_TRUE(shot.pose_quality.has_value()) << shot.name;
    EXPECT_GT(shot.pose_quality->points, 20);
    EXPECT_GT(shot.pose_quality->covariance.diagonal().minCoeff(), 0);
  }
  const TargetModel model = TargetModel::of(again);
  EXPECT_EQ(model.photos.size(), 10u);
  EXPECT_EQ(model.calibration.bodies.size(), 6u);
  EXPECT_EQ(model.calibration.rms_px, report.model.calibration.rms_px);
  EXPECT_EQ(model.calibration.photos[3].covariance, again.shots[3].pose_quality->covariance);
  EXPECT_FALSE(model.starts[0].camera.has_value());
  EXPECT_EQ(model.starts[0].focal_px, 0);
}

TEST_F(CalibrateCapture, APhotographTakenInAMirrorIsNamed) {
  // One of the photographs, left and right exchanged.
  const Image photo = read_image(scene_->photos[3]);
  Image flipped = photo;
  for (int y = 0; y < photo.height(); ++y)
    for (int x = 0; x < photo.width(); ++x)
      for (int c = 0; c < photo.channels(); ++c)
        flipped.row<std::uint8_t>(y)[(photo.width() - 1 - x) * photo.channels() + c] =
            photo.row<std::uint8_t>(y)[x * photo.channels() + c];
  std::vector<fs::path> photos = scene_->photos;
  photos[3] = mine_ / "p3.png";
  write_png(photos[3], flipped);
  ImportOptions import;
  import.output = mine_ / "capture";
  Capture capture = import_photos(photos, import, job_);
  calibrate_capture(capture, options(), job_);
  EXPECT_FALSE(capture.positioned(3));
  const TargetModel model = TargetModel::of(capture);
  const auto& removed = model.calibration.removed;
  EXPECT_TRUE(std::any_of(removed.begin(), removed.end(), [](const Removed& r) {
    return r.kind == Removed::Kind::photo && r.why == Removed::Why::mirrored && r.photo == 3;
  }));
  for (std::size_t i = 0; i < capture.shots.size(); ++i) EXPECT_EQ(capture.positioned(i), i != 3) << i;
}

TEST_F(CalibrateCapture, TheReportIsOnePageOnItsOwn) {
  Capture capture = imported();
  calibrate_capture(capture, options(), job_);
  std::string page = read_file(capture.folder() / "calibration.html");
  EXPECT_THAT(page, HasSubstr("</html>"));
  const std::string picture = "data:image/jpeg;base64,";
  EXPECT_THAT(page, HasSubstr(picture));
  for (std::size_t at = 0; (at = page.find(picture, at)) != std::string::npos; at += picture.size())
    page.erase(at + picture.size(), page.find('"', at) - at - picture.size());
  // Nothing is fetched: no address but the name of SVG's name space.
  const std::regex address("(href|src)=\"(?!data:)|url\\(|@import|https?://(?!www\\.w3\\.org/2000/svg)");
  std::smatch found;
  EXPECT_FALSE(std::regex_search(page, found, address)) << found.str();
  EXPECT_EQ(page.find("nan"), std::string::npos);
  for (const char* tag : {"svg", "table", "details", "figure", "div", "ul"}) {
    const auto count = [&](const std::string& text) {
      std::size_t n = 0;
      for (std::size_t at = 0; (at = page.find(text, at)) != std::string::npos; ++at) ++n;
      return n;
    };
    EXPECT_EQ(count(std::string("<") + tag + " ") + count(std::string("<") + tag + ">"),
              count(std::string("</") + tag + ">"))
        << tag;
  }
}

TEST_F(CalibrateCapture, TakesUpWhatWasFoundBefore) {
  Capture capture = imported();
  const TargetSet set = TargetSet::from_text(options().targets);
  const CaptureDetections first = detect_capture(capture, set, {}, job_);
  EXPECT_EQ(first.kept, 0u);
  const CaptureDetections second = detect_capture(capture, set, {}, job_);
  EXPECT_EQ(second.kept, capture.shots.size());
  for (std::size_t i = 0; i < first.photos.size(); ++i) {
    ASSERT_EQ(first.photos[i].targets.size(), second.photos[i].targets.size());
    EXPECT_EQ(first.photos[i].shot, int(i));
    for (std::size_t t = 0; t < first.photos[i].targets.size(); ++t) {
      const Detection &a = first.photos[i].targets[t], &b = second.photos[i].targets[t];
      EXPECT_EQ(a.id, b.id);
      EXPECT_EQ(a.pixel_from_target, b.pixel_from_target);
      ASSERT_EQ(a.features.size(), b.features.size());
      for (std::size_t k = 0; k < a.features.size(); ++k) {
        EXPECT_EQ(a.features[k].pixel, b.features[k].pixel);
        EXPECT_EQ(a.features[k].covariance, b.features[k].covariance);
        EXPECT_EQ(a.features[k].dual_conic, b.features[k].dual_conic);
      }
    }
  }
  // Another set, another option, a damaged file, a changed photograph: only these are looked at again.
  EXPECT_EQ(detect_capture(capture, set, {.ink_key = {}, .min_circle_px = 6}, job_).kept, 0u);
  detect_capture(capture, set, {}, job_);
  write_file(detections_path(capture, capture.shots[2]), "{\"format\": \"lumihull-detections\", \"version\": 1");
  write_png(capture.photo_path(capture.shots[5]), Image(640, 480, 3));
  capture.refresh_stamps(job_);
  const CaptureDetections third = detect_capture(capture, set, {}, job_);
  EXPECT_EQ(third.kept, capture.shots.size() - 2);
  EXPECT_EQ(third.photos[2].targets.size(), first.photos[2].targets.size());
  EXPECT_TRUE(third.photos[5].targets.empty());
}

TEST_F(CalibrateCapture, StopsInTheMiddleAndGoesOn) {
  Capture capture = imported();
  const std::string before = read_file(capture.folder() / "cameras.json");
  Job stopped(
      [&](const Progress& p) {
        if (p.stage == "finding targets" && p.done >= 3 && p.done < p.total) stopped.cancel();
      },
      1);
  EXPECT_EQ(test::expect_error([&] { calibrate_capture(capture, options(), stopped); }).code(), ErrorCode::cancelled);
  EXPECT_EQ(read_file(capture.folder() / "cameras.json"), before);
  EXPECT_FALSE(fs::exists(target_model_path(capture)));
  const CalibrateCaptureReport report = calibrate_capture(capture, options(), job_);
  EXPECT_GE(report.kept, 3u);
  EXPECT_LT(scene_->center_error_m(poses_of(capture)), 5e-4);
}

TEST_F(CalibrateCapture, SayWhatIsWrong) {
  Capture capture = imported();
  CalibrateCaptureOptions o;
  EXPECT_EQ(test::expect_error([&] { calibrate_capture(capture, o, job_); }).subject(), "targets");
  o.targets = "chessboard:9x6:25mm";
  EXPECT_EQ(test::expect_error([&] { calibrate_capture(capture, o, job_); }).code(), ErrorCode::invalid_argument);
  o.targets = "apriltag:36h11:40mm";
  const Error none = test::expect_error([&] { calibrate_capture(capture, o, job_); });
  EXPECT_EQ(none.code(), ErrorCode::degenerate);
  EXPECT_THAT(none.message(), HasSubstr("apriltag:36h11:40mm"));
  o = options();
  LensCalibration lens;
  lens.camera = {.width = 800, .height = 600, .f = 900, .u0 = 400, .v0 = 300};
  save_intrinsics(mine_ / "other.json", lens);
  o.intrinsics = mine_ / "other.json";
  EXPECT_THAT(test::expect_error([&] { calibrate_capture(capture, o, job_); }).message(), HasSubstr("800 x 600"));
}

TEST_F(CalibrateCapture, StartsFromWhatIsKnown) {
  Capture capture = imported();
  EXPECT_FALSE(camera_starts(capture, {})[0].camera.has_value()) << "import's guess is no knowledge";
  capture.cameras[0].f += 1;  // somebody set it
  ASSERT_TRUE(camera_starts(capture, {})[0].camera.has_value());
  EXPECT_EQ(camera_starts(capture, {})[0].camera->f, capture.cameras[0].f);

  LensCalibration lens;
  lens.camera = scene_->camera;
  save_intrinsics(mine_ / "lens.json", lens);
  CalibrateCaptureOptions o = options();
  o.intrinsics = mine_ / "lens.json";
  o.solve.refine_intrinsics = false;
  calibrate_capture(capture, o, job_);
  EXPECT_EQ(capture.cameras[0].f, scene_->camera.f);
  EXPECT_EQ(capture.cameras[0].k2, scene_->camera.k2);
  EXPECT_TRUE(capture.camera_covariances.empty());
  EXPECT_LT(scene_->center_error_m(poses_of(capture)), 5e-4);

  // After refinement the next run starts from what was known before, so that it gives the same.
  calibrate_capture(capture, options(), job_);
  const double f = capture.cameras[0].f;
  EXPECT_NE(f, scene_->camera.f);
  EXPECT_EQ(camera_starts(capture, {})[0].camera->f, scene_->camera.f);
  calibrate_capture(capture, options(), job_);
  EXPECT_EQ(capture.cameras[0].f, f);
}

TEST_F(CalibrateCapture, TracksAreWhereCentresAreSeen) {
  Capture capture = imported();
  EXPECT_TRUE(target_tracks(capture).empty());
  const CalibrateCaptureReport report = calibrate_capture(capture, options(), job_);
  const std::vector<Track> tracks = target_tracks(capture);
  EXPECT_GT(tracks.size(), 100u);
  double squares = 0;
  std::size_t n = 0;
  for (const Track& track : tracks)
    for (const Track::Sight& sight : track.sights) {
      squares += (*capture.view(sight.shot).project(track.point) - sight.pixel).squaredNorm();
      ++n;
    }
  std::size_t counted = 0;
  for (const CalibrationResidual& r : report.model.calibration.residuals) counted += !r.removed;
  EXPECT_NEAR(double(n), double(counted), 0.01 * double(counted));
  EXPECT_NEAR(std::sqrt(squares / double(n)), report.model.calibration.rms_px, 0.02 * report.model.calibration.rms_px);
}

}  // namespace
}  // namespace lumihull::calib
