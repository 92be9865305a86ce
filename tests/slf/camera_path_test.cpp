#include <lumihull/base/files.h>
#include <lumihull/slf/camera_path.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "support.h"
#include "synthetic.h"

namespace lumihull {
namespace {

using test::around;
using test::camera;

TEST(CameraPath, UpIsTheMeanOfTheCamerasUps) {
  std::vector<View> views = around(12, 1, 4, camera(100, 100, 100));
  EXPECT_LT((slf::up_axis(views) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  // Another world: the answer turns with it.
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()));
  for (View& v : views) v.cam_from_world = v.cam_from_world * Pose{turn.conjugate(), {1, 2, 3}};
  EXPECT_LT((slf::up_axis(views) - turn * Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(slf::up_axis({}), Eigen::Vector3d(0, 0, 1));
}

TEST(CameraPath, ATurntableGoesAroundTheObject) {
  const hull::Mesh mesh = test::box({-1, 2, 4}, {1, 5, 6});
  const Eigen::Vector3d middle(0, 3.5, 5);
  slf::TurntableOptions options;
  options.frames = 8;
  const std::vector<View> photographs = around(12, 1, 4, camera(100, 100, 100));
  const auto path = slf::turntable(mesh, photographs, options);
  ASSERT_EQ(path.size(), 8u);
  EXPECT_EQ(path[3].name, "frame_0003");
  for (std::size_t i = 0; i < path.size(); ++i) {
    const View& v = path[i].view;
    const Eigen::Vector3d outwards = v.center() - middle;
    EXPECT_NEAR(std::asin(outwards.z() / outwards.norm()), 20 * std::numbers::pi / 180, 1e-9);
    EXPECT_NEAR(outwards.norm(), (path[0].view.center() - middle).norm(), 1e-9);
    for (const auto& corner : mesh.vertices) {  // all of it in every picture
      const auto px = v.project(corner.cast<double>());
      ASSERT_TRUE(px && v.camera.contains(*px));
    }
    const auto px = v.project(middle);
    EXPECT_LT((*px - Eigen::Vector2d(640, 360)).norm(), 1e-6);
    EXPECT_LT((v.cam_from_world.rotation * Eigen::Vector3d::UnitZ()).y(), -0.5);  // upright
  }
  options.elevation_deg = 90;  // straight from above
  EXPECT_TRUE(slf::turntable(mesh, photographs, options)[0].view.cam_from_world.rotation.coeffs().allFinite());
}

TEST(CameraPath, UpOfPortraitPicturesIsAlongTheirLongerSide) {
  const Eigen::Vector3d up = Eigen::Vector3d(.3, -.2, 1).normalized();
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  for (const double roll : {0., .5, -.5}) {  // landscape, portrait either way; half turns
    std::vector<View> views;
    for (int i = 0; i < 24; ++i) {
      // From above to level, all around, held a little askew.
      const double azimuth = 2.4 * i, polar = .3 + .05 * i, askew = .06 * std::sin(5. * i);
      const Eigen::Vector3d eye(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                                std::cos(polar));
      Pose pose = look_at(turn * eye, Eigen::Vector3d::Zero(), up);
      pose.rotation = Eigen::AngleAxisd(roll * 3.14159265358979 + askew, Eigen::Vector3d::UnitZ()) * pose.rotation;
      views.push_back({camera(60, 40, 50), pose});
    }
    EXPECT_GT(slf::up_axis(views).dot(up), std::cos(.05)) << roll;  // 24 azimuths do not cancel quite
  }
}

TEST(CameraPath, UpDoesNotDependOnTheSidesThatPhotographsAreFrom) {
  const Eigen::Vector3d up = Eigen::Vector3d(-.1, .4, 1).normalized();
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  for (const double roll : {0., .5, -.5})
    for (const double from : {0., 1., 2.5}) {
      std::vector<View> views;
      for (int i = 0; i < 8; ++i) {  // within a quarter of a turn, from rather high up to level
        const double azimuth = from + .2 * i, polar = .5 + .13 * ((5 * i) % 8), askew = .03 * std::sin(5. * i);
        const Eigen::Vector3d eye(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                                  std::cos(polar));
        Pose pose = look_at(turn * eye, Eigen::Vector3d::Zero(), up);
        pose.rotation = Eigen::AngleAxisd(roll * 3.14159265358979 + askew, Eigen::Vector3d::UnitZ()) * pose.rotation;
        views.push_back({camera(60, 40, 50), pose});
      }
      EXPECT_GT(slf::up_axis(views).dot(up), std::cos(.06)) << roll << ' ' << from;
    }
}

TEST(CameraPath, FilesComeBackAsTheyWere) {
  const test::TemporaryFolder folder;
  Camera bent = camera(123, 77, 99.5);
  bent.s = 1.01, bent.skew = -3, bent.k1 = 0.01, bent.k3 = -1e-4, bent.p2 = 2e-3, bent.u0 = -50;
  std::vector<slf::PathView> path;
  for (const View& v : around(3, 1, 4, bent)) path.push_back({"view " + std::to_string(path.size()), v});
  slf::write_camera_path(folder / "p.json", path);
  const auto back = slf::read_camera_path(folder / "p.json");
  ASSERT_EQ(back.size(), path.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(back[i].name, path[i].name);
    EXPECT_EQ(back[i].view.camera.matrix(), path[i].view.camera.matrix());
    EXPECT_EQ(back[i].view.camera.p2, bent.p2);
    EXPECT_LT((back[i].view.cam_from_world.matrix() - path[i].view.cam_from_world.matrix()).norm(), 1e-14);
  }
}

TEST(CameraPath, EyeTargetAndUpDoInsteadOfAPose) {
  const test::TemporaryFolder folder;
  write_file(folder / "p.json", R"({"format": "lumihull-camera-path", "version": 1, "views":
    [{"width": 64, "height": 48, "f": 60, "eye": [0, 4, 0], "target": [0, 0, 0], "up": [0, 0, 1]}]})");
  const auto path = slf::read_camera_path(folder / "p.json");
  EXPECT_EQ(path[0].name, "frame_0000");
  EXPECT_LT((path[0].view.center() - Eigen::Vector3d(0, 4, 0)).norm(), 1e-12);
  EXPECT_EQ(path[0].view.camera.u0, 32);
}

TEST(CameraPath, ComplaintsNameFileAndPlace) {
  const test::TemporaryFolder folder;
  const auto complaint = [&](const std::string& view) {
    write_file(folder / "p.json", R"({"format": "lumihull-camera-path", "version": 1, "views": [)" + view + "]}");
    const Error e = test::expect_error([&] { slf::read_camera_path(folder / "p.json"); });
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_NE(e.subject().find("p.json"), std::string::npos);
    return e.message();
  };
  const std::string pose = R"("cam_from_world": {"rotation_wxyz": [1, 0, 0, 0], "translation": [0, 0, 2]})";
  using testing::HasSubstr;
  EXPECT_THAT(complaint(""), HasSubstr("/views"));
  EXPECT_THAT(complaint(R"({"height": 48, "f": 60, )" + pose + "}"), HasSubstr("width"));
  EXPECT_THAT(complaint(R"({"width": 1e9, "height": 48, "f": 60, )" + pose + "}"), HasSubstr("/views/0/width"));
  EXPECT_THAT(complaint(R"({"width": 64, "height": 48, "f": -60, )" + pose + "}"), HasSubstr("/views/0"));
  EXPECT_THAT(complaint(R"({"width": 64, "height": 48, "f": 60, "name": "../x", )" + pose + "}"),
              HasSubstr("/views/0/name"));
  EXPECT_THAT(complaint(R"({"width": 64, "height": 48, "f": 60})"), HasSubstr("cam_from_world"));
  EXPECT_THAT(complaint(R"({"width": 64, "height": 48, "f": 60, "eye": [0,0,1], "target": [0,0,1], "up": [0,1,0]})"),
              HasSubstr("eye apart"));
  EXPECT_THAT(complaint(R"({"width": 64, "height": 48, "f": 60,
                "cam_from_world": {"rotation_wxyz": [0, 0, 0, 0], "translation": [0, 0, 2]}})"),
              HasSubstr("rotation_wxyz"));
  EXPECT_EQ(test::expect_error([&] { slf::read_camera_path(folder / "none.json"); }).code(), ErrorCode::not_found);
}

TEST(CameraPath, TurntableFaults) {
  const hull::Mesh mesh = test::sphere(4);
  slf::TurntableOptions options;
  options.frames = 0;
  EXPECT_EQ(test::expect_error([&] { slf::turntable(mesh, {}, options); }).code(), ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([&] { slf::turntable({}, {}); }).code(), ErrorCode::degenerate);
}

}  // namespace
}  // namespace lumihull
