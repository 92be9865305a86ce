#include <lumihull/base/export.h>
#include <lumihull/base/files.h>
#include <lumihull/calib/lens_calibration.h>

#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>

#include "support.h"
#include "synthetic_views.h"

namespace lumihull::calib {
namespace {

using testing::HasSubstr;

LensCalibration example() {
  const test::ViewMaker maker{.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .noise = 0.1};
  Job job;
  return calibrate_lens(test::make_views(maker, 6, 1), 1600, 1200, {}, job);
}

TEST(IntrinsicsFile, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  const LensCalibration made = example();
  save_intrinsics(folder / "camera.json", made);
  const LensCalibration read = load_intrinsics(folder / "camera.json");
  EXPECT_EQ(read.covariance, made.covariance);
  EXPECT_EQ(read.camera.f, made.camera.f);
  EXPECT_EQ(read.camera.p2, made.camera.p2);
  EXPECT_EQ(read.camera.width, 1600);
  save_intrinsics(folder / "again.json", read);
  EXPECT_EQ(load_intrinsics(folder / "again.json").covariance, made.covariance);
}

TEST(IntrinsicsFile, HostileOnesAreRefused) {
  const test::TemporaryFolder folder;
  const auto good = nlohmann::ordered_json::parse(intrinsics_json(example()));
  const auto refused = [&](const std::string& text, const std::string& what) {
    SCOPED_TRACE(what);
    write_file(folder / "bad.json", text);
    const Error error = test::expect_error([&] { load_intrinsics(folder / "bad.json"); });
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    EXPECT_THAT(error.what(), HasSubstr(what));
  };
  refused("", "JSON");
  refused("{", "JSON");
  refused("[]", "an object");
  const auto spoilt = [&](const char* pointer, const nlohmann::ordered_json& value) {
    auto copy = good;
    copy[nlohmann::ordered_json::json_pointer(pointer)] = value;
    return copy.dump();
  };
  refused(spoilt("/format", "lumihull-targets"), "/format");
  refused(spoilt("/version", 2), "/version");
  refused(spoilt("/camera/f", 0), "/camera/f");
  refused(spoilt("/camera/f", "x"), "/camera/f");
  refused(spoilt("/camera/width", 1000000000), "/camera/width");
  refused(spoilt("/camera/k1", nullptr), "/camera/k1");
  refused(spoilt("/parameters/3", "cx"), "/parameters/3");
  refused(spoilt("/covariance", 3), "/covariance");
  refused(spoilt("/covariance/2", nlohmann::ordered_json::array()), "/covariance/2");
  refused(spoilt("/covariance/0/0", -1), "/covariance/0");
  refused(spoilt("/covariance/0/3", 1e9), "symmetric");
  auto wild = good;
  wild["covariance"][0][3] = wild["covariance"][3][0] = 1e6;
  refused(wild.dump(), "no negative eigenvalue");
  auto half = good;
  half["covariance"][1][0] = half["covariance"][0][1] = 1e-3;
  refused(half.dump(), "/covariance/1");
  EXPECT_EQ(test::expect_error([&] { load_intrinsics(folder / "none.json"); }).code(), ErrorCode::not_found);
}

TEST(CameraText, OpenCvReadsItAndProjectsTheSame) {
  const Camera camera = test::wide_camera();
  const CameraText text = opencv_camera(camera);
  const cv::FileStorage storage(text.text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::Mat k, lens;
  storage["camera_matrix"] >> k;
  storage["distortion_coefficients"] >> lens;
  EXPECT_EQ(int(storage["image_width"]), camera.width);
  double largest = 0;
  for (int y = 0; y <= 12; ++y)
    for (int x = 0; x <= 16; ++x) {
      const Eigen::Vector2d px(camera.width * x / 16.0, camera.height * y / 12.0);
      const Eigen::Vector3d ray = *camera.ray(px);
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{{ray.x(), ray.y(), ray.z()}}, cv::Vec3d(), cv::Vec3d(), k, lens, seen);
      largest = std::max(largest, (Eigen::Vector2d(seen[0].x + 0.5, seen[0].y + 0.5) - px).norm());
    }
  EXPECT_LE(largest, text.largest_error_px + 1e-6);
  EXPECT_LT(text.largest_error_px, 0.1);
  Camera plain = camera;
  plain.k1 = plain.k2 = plain.p1 = plain.p2 = 0;
  EXPECT_EQ(opencv_camera(plain).largest_error_px, 0);
  plain.skew = 50;
  EXPECT_EQ(test::expect_error([&] { opencv_camera(plain); }).code(), ErrorCode::unsupported);
}

TEST(CameraText, ColmapsLine) {
  const CameraText text = colmap_camera(test::wide_camera());
  EXPECT_THAT(text.text, HasSubstr("\n1 "));
  EXPECT_THAT(text.text, HasSubstr("OPENCV 1600 1200 "));
  EXPECT_LT(text.largest_error_px, 0.5);
}

TEST(LensReport, HoldsItsFiguresAndNothingFromOutside) {
  const test::ViewMaker maker{.camera = test::wide_camera(), .body = test::plane_points(9, 7, 0.03), .noise = 0.1};
  auto views = test::make_views(maker, 6, 1);
  views[2].name = "<script>&\"";
  Job job;
  const LensCalibration found = calibrate_lens(views, 1600, 1200, {}, job);
  const std::string page = lens_report_html(found, views, "A <lens>");
  EXPECT_THAT(page, HasSubstr("A &lt;lens&gt;"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, testing::Not(HasSubstr("<script")));
  EXPECT_THAT(page, testing::Not(HasSubstr("src=")));
  std::size_t figures = 0;
  for (std::size_t at = 0; (at = page.find("<svg", at)) != std::string::npos; ++at) ++figures;
  EXPECT_EQ(figures, 4u);
  views.pop_back();
  EXPECT_EQ(test::expect_error([&] { lens_report_html(found, views, "x"); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::calib
