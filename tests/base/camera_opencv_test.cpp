// OpenCV's lens model has the same polynomial in the other direction: its distortion is our `correct`, its iterated
// undistortion our `distort`. OpenCV's pixel centres are whole numbers, which does not matter on the normalised plane.

#include <lumihull/base/camera.h>

#include <opencv2/calib3d.hpp>
#include <random>

#include "support.h"

namespace lumihull {
namespace {

class AgainstOpenCV : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    std::mt19937_64 random{std::uint64_t(GetParam())};
    const auto uniform = [&](double a) { return std::uniform_real_distribution<double>(-a, a)(random); };
    camera_ = {.width = 100,
               .height = 100,
               .f = 1,
               .k1 = uniform(0.15),
               .k2 = uniform(0.05),
               .k3 = uniform(0.01),
               .p1 = uniform(0.004),
               .p2 = uniform(0.004)};
    for (int i = 0; i < 500; ++i) points_.emplace_back(uniform(0.5), uniform(0.5));
  }
  cv::Mat coefficients() const {
    return (cv::Mat_<double>(1, 5) << camera_.k1, camera_.k2, camera_.p1, camera_.p2, camera_.k3);
  }

  Camera camera_;
  std::vector<cv::Point2d> points_;
};

TEST_P(AgainstOpenCV, ItsDistortionIsOurCorrection) {
  std::vector<cv::Point3d> space;
  for (const auto& p : points_) space.emplace_back(p.x, p.y, 1);
  std::vector<cv::Point2d> theirs;
  const cv::Mat none = cv::Mat::zeros(3, 1, CV_64F);
  cv::projectPoints(space, none, none, cv::Mat::eye(3, 3, CV_64F), coefficients(), theirs);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector2d ours = camera_.correct({points_[i].x, points_[i].y});
    EXPECT_NEAR(ours.x(), theirs[i].x, 1e-10);
    EXPECT_NEAR(ours.y(), theirs[i].y, 1e-10);
  }
}

TEST_P(AgainstOpenCV, ItsUndistortionIsOurDistortion) {
  std::vector<cv::Point2d> theirs;
  cv::undistortPoints(points_, theirs, cv::Mat::eye(3, 3, CV_64F), coefficients(), cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-14));
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto ours = camera_.distort({points_[i].x, points_[i].y});
    ASSERT_TRUE(ours);
    EXPECT_NEAR(ours->x(), theirs[i].x, 1e-10);
    EXPECT_NEAR(ours->y(), theirs[i].y, 1e-10);
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, AgainstOpenCV, testing::Range(0, 12));

}  // namespace
}  // namespace lumihull
