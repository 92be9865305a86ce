// Where things are in a photograph, against OpenCV and the algebra of conics.

#include <lumihull/base/error.h>

#include <Eigen/LU>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "objects/noise.h"
#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// A tent with radiance 1 everywhere around an object at height 1: a matt one shows its texture as it is.
Scene in_a_tent(Object object) {
  Scene scene;
  scene.objects = {std::move(object)};
  scene.enclosure.color = Vector3f::Zero();
  scene.enclosure.glow = scene.enclosure.ceiling = Vector3f::Ones();
  scene.enclosure.unevenness = 0;
  return scene;
}

TEST(Projection, ATexturedPlaneIsWhereOpenCVPutsIt) {
  constexpr int kTexels = 256;
  Image texture(kTexels, kTexels, 3);
  for (int y = 0; y < kTexels; ++y)
    for (int x = 0; x < kTexels; ++x) {
      const float v = 128 + 150 * fractal_noise(Vector3f(x / 14.f, y / 14.f, 0), 2, 3);
      for (int c = 0; c < 3; ++c)
        texture.row<std::uint8_t>(y)[3 * x + c] = std::uint8_t(std::clamp(v + 8.f * float(c), 20.f, 230.f));
    }
  Object plate;
  plate.name = "plate";
  const float half = .2f, thick = .02f;
  for (int c = 0; c < 8; ++c)
    plate.mesh.vertices.emplace_back(c & 1 ? half : -half, c & 2 ? half : -half, c & 4 ? 1 : 1 - thick);
  plate.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& t : plate.mesh.triangles) {
    std::array<Eigen::Vector2f, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) uv[k] = {t[k] & 1 ? 1.f : 0.f, t[k] & 2 ? 1.f : 0.f};
    plate.uv.push_back(uv);
  }
  plate.texture = texture;
  plate.material.reflectance = 0;
  const Scene scene = in_a_tent(plate);
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  PhotoOptions options = test::noiseless();
  options.rays = options.edge_rays = 4;
  const Camera camera = sensor_camera(360, 18, 22.7, 0);
  for (const auto& [eye, up] : {std::pair{Vector3d(.02, -.03, 1.7), Vector3d(0, 1, 0)},
                                std::pair{Vector3d(.45, -.35, 1.45), Vector3d(.3, 1, .2)}}) {
    const View view{camera, look_at(eye, {.01, .02, 1}, up)};
    const Image picture = photographer.photograph(view, options, 1, job).picture;

    // OpenCV: pixel centres are whole numbers; texture's first texel has its centre at (1/2, 1/2) texels.
    const Eigen::Matrix3d r = view.cam_from_world.rotation.toRotationMatrix();
    cv::Mat rotation(3, 3, CV_64F), rvec, tvec(3, 1, CV_64F);
    for (int i = 0; i < 3; ++i) {
      tvec.at<double>(i) = view.cam_from_world.translation[i];
      for (int j = 0; j < 3; ++j) rotation.at<double>(i, j) = r(i, j);
    }
    cv::Rodrigues(rotation, rvec);
    const cv::Matx33d k(camera.f, 0, camera.u0 - .5, 0, camera.f, camera.v0 - .5, 0, 0, 1);
    const std::vector<cv::Point3d> corners{{-half, half, 1}, {half, half, 1}, {half, -half, 1}, {-half, -half, 1}};
    std::vector<cv::Point2d> px;
    cv::projectPoints(corners, rvec, tvec, k, cv::noArray(), px);
    const double end = kTexels - .5;
    const std::vector<cv::Point2f> from{{-.5f, -.5f}, {float(end), -.5f}, {float(end), float(end)}, {-.5f, float(end)}};
    const std::vector<cv::Point2f> to(px.begin(), px.end());
    // Four times as fine, in linear light, then the mean of 4 x 4.
    cv::Mat linear(kTexels, kTexels, CV_32FC3), fine, expected;
    for (int y = 0; y < kTexels; ++y)
      for (int i = 0; i < 3 * kTexels; ++i)
        linear.ptr<float>(y)[i] = linear_from_srgb(texture.row<std::uint8_t>(y)[i] / 255.f);
    cv::Mat h = cv::getPerspectiveTransform(from, to);
    h = cv::Mat(cv::Matx33d(4, 0, 1.5, 0, 4, 1.5, 0, 0, 1)) * h;
    cv::warpPerspective(linear, fine, h, {4 * camera.width, 4 * camera.height}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::resize(fine, expected, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);

    // Away from the plate's border: difference in grey levels, and the shift that explains most of it.
    std::vector<cv::Point2f> hull(to);
    double sum = 0;
    int n = 0;
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Vector2d right = Vector2d::Zero();
    const auto grey = [&](int x, int y) { return 255 * double(srgb_from_linear(expected.at<cv::Vec3f>(y, x)[1])); };
    for (int y = 1; y + 1 < camera.height; ++y)
      for (int x = 1; x + 1 < camera.width; ++x) {
        if (cv::pointPolygonTest(hull, cv::Point2f(float(x), float(y)), true) < 3) continue;
        const double d = picture.row<std::uint8_t>(y)[3 * x + 1] - grey(x, y);
        const Vector2d g(.5 * (grey(x + 1, y) - grey(x - 1, y)), .5 * (grey(x, y + 1) - grey(x, y - 1)));
        sum += d * d, ++n;
        normal += g * g.transpose(), right += g * d;
      }
    ASSERT_GT(n, 5000);
    const Vector2d shift = normal.inverse() * right;
    RecordProperty("rms", std::to_string(std::sqrt(sum / n)));
    RecordProperty("shift", std::to_string(shift.norm()));
    std::printf("textured plane: %.3f grey levels RMS, shift %.4f px (%d px)\n", std::sqrt(sum / n), shift.norm(), n);
    EXPECT_LT(std::sqrt(sum / n), .7);
    EXPECT_LT(shift.norm(), .005);
  }
}

TEST(Projection, ATracedDiscHasTheCentreOfItsConic) {
  constexpr int kSides = 720;
  constexpr double kRadius = .1;
  Object disc;
  disc.name = "disc";
  // A polygon with the circle's area; its lower side is a cone that no camera above sees.
  const double radius = kRadius * std::sqrt(2 * M_PI / kSides / std::sin(2 * M_PI / kSides));
  for (int i = 0; i < kSides; ++i)
    disc.mesh.vertices.emplace_back(float(radius * std::cos(2 * M_PI * i / kSides)),
                                    float(radius * std::sin(2 * M_PI * i / kSides)), 1.f);
  disc.mesh.vertices.emplace_back(0.f, 0.f, 1.f);
  disc.mesh.vertices.emplace_back(0.f, 0.f, .98f);
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t j = (i + 1) % kSides;
    disc.mesh.triangles.push_back({kSides, i, j});
    disc.mesh.triangles.push_back({kSides + 1, j, i});
  }
  disc.material.unlit = true;
  const Scene scene = in_a_tent(disc);
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  PhotoOptions options = test::noiseless();
  options.rays = 4, options.edge_rays = 24;
  const Camera camera = sensor_camera(240, 18, 22.7, 0);
  double worst = 0;
  for (int i = 0; i < 6; ++i) {
    const double tilt = .2 + .17 * i, turn = 1.1 * i;
    const Vector3d eye = Vector3d(0, 0, 1) + .45 * Vector3d(std::sin(tilt) * std::cos(turn),
                                                            std::sin(tilt) * std::sin(turn), std::cos(tilt));
    const View view{camera, look_at(eye, {.01 * i, -.02, 1}, {0, .1, 1})};
    const Photo photo = photographer.photograph(view, options, 1, job);
    Vector2d middle(0, 0);
    double area = 0;
    for (int y = 0; y < photo.mask.height(); ++y)
      for (int x = 0; x < photo.mask.width(); ++x) {
        const double c = photo.mask.row<std::uint8_t>(y)[x] / 255.;
        area += c, middle += c * Vector2d(x + .5, y + .5);
      }
    middle /= area;
    // The circle's dual conic in its plane, diag(r², r², -1), through the plane's homography.
    const Eigen::Matrix<double, 3, 4> p = camera.matrix() * view.cam_from_world.matrix();
    Eigen::Matrix3d b;
    b << p.col(0), p.col(1), p.col(2) + p.col(3);
    const Eigen::Matrix3d dual = b * Vector3d(kRadius * kRadius, kRadius * kRadius, -1).asDiagonal() * b.transpose();
    const Vector2d expected(dual(0, 2) / dual(2, 2), dual(1, 2) / dual(2, 2));
    worst = std::max(worst, (middle - expected).norm());
    EXPECT_LT((middle - expected).norm(), .005) << "tilt " << tilt;
  }
  std::printf("traced disc: centre within %.4f px\n", worst);
}

}  // namespace
}  // namespace lumihull::rig
