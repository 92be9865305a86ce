// An independent answer: OpenCV's solvePnP (Levenberg-Marquardt, pinhole or through undistorted points) and
// solvePnPRansac.
#include <lumihull/calib/resect.h>

#include <opencv2/calib3d.hpp>

#include "resect_scenes.h"
#include "support.h"

namespace lumihull::calib {
namespace {

struct CvMatches {
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;
  cv::Mat matrix;
};

/// OpenCV's pixels: the first one's centre is (0, 0).
CvMatches for_opencv(const test::ResectScene& scene) {
  CvMatches m;
  for (const PointMatch& p : scene.matches) {
    m.world.push_back({p.world.x(), p.world.y(), p.world.z()});
    m.pixels.push_back({p.pixel.x() - 0.5, p.pixel.y() - 0.5});
  }
  const Camera& c = scene.camera;
  m.matrix = (cv::Mat_<double>(3, 3) << c.s * c.f, 0, c.u0 - 0.5, 0, c.f, c.v0 - 0.5, 0, 0, 1);
  return m;
}

Pose from_opencv(const cv::Mat& rotation, const cv::Mat& translation) {
  cv::Mat r;
  cv::Rodrigues(rotation, r);
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = r.at<double>(i / 3, i % 3);
  return Pose::from_matrix(m, {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)});
}

test::ResectScene pinhole_scene(std::uint64_t seed, int points, bool planar, double wrong_share = 0) {
  auto scene =
      test::resect_scene(seed, {.points = points, .planar = planar, .distorted = false, .wrong_share = wrong_share});
  scene.camera.skew = 0;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.1);
  for (std::size_t i = 0; i < scene.matches.size(); ++i) {  // equal covariances: OpenCV knows no others
    PointMatch& m = scene.matches[i];
    m.covariance = 0.01 * Eigen::Matrix2d::Identity();
    if (std::binary_search(scene.wrong.begin(), scene.wrong.end(), std::uint32_t(i))) continue;
    m.pixel = *scene.camera.project(scene.cam_from_world * m.world) + Eigen::Vector2d(noise(random), noise(random));
  }
  return scene;
}

TEST(ResectOpenCv, TheLeastSquaresPoseIsTheirs) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const auto scene = pinhole_scene(seed, 8 + int(seed), seed % 2);
    const auto cv_matches = for_opencv(scene);
    const Resection r = resect(scene.camera, scene.matches, {.robust = false});
    cv::Mat rotation, translation;
    cv::solvePnP(cv_matches.world, cv_matches.pixels, cv_matches.matrix, cv::noArray(), rotation, translation, false,
                 cv::SOLVEPNP_ITERATIVE);
    // Their iteration stops earlier.
    EXPECT_LT(test::angle_between(r.cam_from_world, from_opencv(rotation, translation)), 2e-6);
  }
}

TEST(ResectOpenCv, BothFindTheSameAmongWrongMatches) {
  for (std::uint64_t seed = 0; seed < 15; ++seed) {
    SCOPED_TRACE(seed);
    const auto scene = pinhole_scene(seed, 100, seed % 2, 0.4);
    const auto cv_matches = for_opencv(scene);
    const Resection r = resect(scene.camera, scene.matches);
    cv::Mat rotation, translation;
    std::vector<int> inliers;
    cv::theRNG().state = seed + 1;
    ASSERT_TRUE(cv::solvePnPRansac(cv_matches.world, cv_matches.pixels, cv_matches.matrix, cv::noArray(), rotation,
                                   translation, false, 5000, 1.5F, 0.9999, inliers));
    const double theirs = test::angle_between(from_opencv(rotation, translation), scene.cam_from_world);
    const double ours = test::angle_between(r.cam_from_world, scene.cam_from_world);
    EXPECT_TRUE(std::includes(r.outliers.begin(), r.outliers.end(), scene.wrong.begin(), scene.wrong.end()));
    EXPECT_LE(r.outliers.size(), scene.wrong.size() + 1);
    EXPECT_LT(ours, 3e-4);
    EXPECT_LT(test::angle_between(from_opencv(rotation, translation), r.cam_from_world), 1e-3) << theirs;
  }
}

}  // namespace
}  // namespace lumihull::calib
