#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using test::coarse_light;
using test::noiseless;
using test::view_of;

struct Ball {
  Scene scene = make_scene(make_sphere(.4, 6), kGreenPaint, false, 5);
  Eigen::Vector3d center = scene.center().cast<double>();
  double radius = .2;

  /// Distance in units of (x, y, 1) directions, that is depth z; 0: missed.
  double depth(const View& view, const Eigen::Vector2d& pixel) const {
    const auto ray = view.camera.ray(pixel);
    if (!ray) return 0;
    const Eigen::Vector3d c = view.cam_from_world * center;
    const double a = ray->squaredNorm(), b = ray->dot(c), d = b * b - a * (c.squaredNorm() - radius * radius);
    return d > 0 ? (b - std::sqrt(d)) / a : 0;
  }
};

TEST(Photographer, MaskOfASphereIsWhatTheFormulaSays) {
  const Ball ball;
  Job job;
  const Photographer photographer(ball.scene, coarse_light(), job);
  for (const bool distortion : {false, true})
    for (int i = 0; i < 2; ++i) {
      SCOPED_TRACE(testing::Message() << distortion << " " << i);
      const View view = view_of(ball.scene, default_camera(240, distortion), i);
      const Photo photo = photographer.photograph(view, noiseless(), 1, job);
      double area = 0, true_area = 0, worst = 0;
      Eigen::Vector2d middle(0, 0), true_middle(0, 0);
      for (int y = 0; y < photo.mask.height(); ++y)
        for (int x = 0; x < photo.mask.width(); ++x) {
          const double covered = photo.mask.row<std::uint8_t>(y)[x] / 255.0;
          constexpr int kFine = 12;
          int hits = 0;
          for (int k = 0; k < kFine * kFine; ++k)
            hits += ball.depth(view, {x + (k % kFine + .5) / kFine, y + (k / kFine + .5) / kFine}) > 0;
          const double expected = double(hits) / (kFine * kFine);
          worst = std::max(worst, std::fabs(covered - expected));
          area += covered, true_area += expected;
          middle += covered * Eigen::Vector2d(x + .5, y + .5),
              true_middle += expected * Eigen::Vector2d(x + .5, y + .5);
        }
      ASSERT_GT(true_area, 2000);
      EXPECT_NEAR(area / true_area, 1, 1e-3);
      EXPECT_LT((middle / area - true_middle / true_area).norm(), .01);
      EXPECT_LT(worst, .3);  // 2 x 2 rays may miss a sliver of an outline
    }
}

TEST(Photographer, DepthIsTheSpheresAndAgreesWithTheMask) {
  const Ball ball;
  Job job;
  const Photographer photographer(ball.scene, coarse_light(), job);
  const View view = view_of(ball.scene, default_camera(240), 3);
  PhotoOptions options = noiseless();
  options.depth = true;
  const Photo photo = photographer.photograph(view, options, 1, job);
  ASSERT_EQ(photo.depth.width(), 240);
  int seen = 0;
  for (int y = 0; y < photo.mask.height(); ++y)
    for (int x = 0; x < photo.mask.width(); ++x) {
      const int covered = photo.mask.row<std::uint8_t>(y)[x];
      const float depth = photo.depth.row<float>(y)[x];
      if (covered == 255) {
        ++seen;
        ASSERT_NEAR(depth, ball.depth(view, {x + .5, y + .5}), 2e-3 * ball.radius) << x << " " << y;
      } else if (covered == 0) {
        ASSERT_EQ(depth, 0) << x << " " << y;
      }
    }
  EXPECT_GT(seen, 2000);
  options.reduce = 2;
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, options, 1, job); }).code(),
            ErrorCode::invalid_argument);
}

TEST(Photographer, ThreadsDoNotChangeABitAndSeedsDo) {
  const Scene scene = make_scene(make_vase(.5, 24), kGreenPaint, true, 2);
  Job one({}, 1), three({}, 3);
  const Photographer a(scene, coarse_light(), one), b(scene, coarse_light(), three);
  const View view = view_of(scene, default_camera(120), 1);
  const Photo p = a.photograph(view, {}, 7, one), q = b.photograph(view, {}, 7, three);
  EXPECT_TRUE(test::same_bytes(p.picture, q.picture));
  EXPECT_TRUE(test::same_bytes(p.mask, q.mask));
  EXPECT_FALSE(test::same_bytes(p.picture, a.photograph(view, {}, 8, one).picture));
}

TEST(Photographer, NoiseIsShotNoisePlusReadNoise) {
  const Scene room = make_scene(make_box(.4), kGreenPaint, false, 3).emptied();
  Job job;
  const Photographer photographer(room, coarse_light(), job);
  const Eigen::Vector3d eye(.9, 0, .8);
  const View view{default_camera(360), look_at(eye, {0, 0, .2}, {0, 0, 1})};
  const Photo clean = photographer.photograph(view, noiseless(), 1, job);
  for (const double full_well : {4000.0, 25000.0}) {
    SCOPED_TRACE(full_well);
    PhotoOptions options;
    options.full_well = full_well;
    const Photo noisy = photographer.photograph(view, options, 1, job);
    double measured = 0, predicted = 0, mean = 0;
    std::size_t n = 0;
    for (int y = 0; y < clean.picture.height(); ++y)
      for (int i = 0; i < 3 * clean.picture.width(); ++i) {
        const int value = clean.picture.row<std::uint8_t>(y)[i];
        if (value < 80 || value > 230) continue;  // away from sRGB's bend and from clipping
        const double linear = linear_from_srgb(float(value) / 255);
        const double slope =
            255 * (srgb_from_linear(float(linear + 1e-3)) - srgb_from_linear(float(linear - 1e-3))) / 2e-3;
        const double read = options.read_noise / full_well;
        predicted += slope * slope * (linear / full_well + read * read) + 1 / 6.;  // two roundings
        const double difference = noisy.picture.row<std::uint8_t>(y)[i] - value;
        measured += difference * difference;
        mean += difference;
        ++n;
      }
    ASSERT_GT(n, 20000u);
    EXPECT_NEAR(measured / predicted, 1, .05);
    EXPECT_LT(std::fabs(mean / double(n)), .05);
  }
}

TEST(Photographer, BehindTheObjectStandsTheEmptyEnclosureShadowsApart) {
  const Scene scene = make_scene(make_sphere(.4, 5), kGreenPaint, false, 4);
  Job job;
  LightOptions light = coarse_light();
  light.floor_texels = 100;
  light.ambient_rays = 16;
  const Photographer with(scene, light, job), without(scene.emptied(), light, job);
  const View view = view_of(scene, default_camera(240), 2);
  const Photo a = with.photograph(view, noiseless(), 1, job), b = without.photograph(view, noiseless(), 1, job);
  std::size_t background = 0, same = 0, brighter = 0, shadow = 0, covered = 0;
  for (int y = 0; y < a.mask.height(); ++y)
    for (int x = 0; x < a.mask.width(); ++x) {
      EXPECT_EQ(b.mask.row<std::uint8_t>(y)[x], 0);
      if (a.mask.row<std::uint8_t>(y)[x] > 0) {
        ++covered;
        continue;
      }
      ++background;
      const int d = a.picture.row<std::uint8_t>(y)[3 * x + 1] - b.picture.row<std::uint8_t>(y)[3 * x + 1];
      same += std::abs(d) <= 2, brighter += d > 3, shadow += d < -8;
    }
  EXPECT_GT(covered, 2000u);
  EXPECT_GT(double(same) / double(background), .5);
  EXPECT_LT(double(brighter) / double(background), .002);
  EXPECT_GT(shadow, 200u);
}

TEST(Photographer, ReducedTracingShowsTheSamePicture) {
  const Scene scene = make_scene(make_bust(.5, 40), kGreenPaint, false, 4);
  Job job;
  const Photographer photographer(scene, coarse_light(), job);
  const View view = view_of(scene, default_camera(601), 0);  // a width that three does not divide
  PhotoOptions options = noiseless();
  const Photo full = photographer.photograph(view, options, 1, job);
  options.reduce = 3;
  const Photo fast = photographer.photograph(view, options, 1, job);
  ASSERT_EQ(fast.picture.width(), 601);
  ASSERT_EQ(fast.picture.height(), full.picture.height());
  double both = 0, either = 0, error = 0;
  for (int y = 0; y < full.mask.height(); ++y)
    for (int x = 0; x < full.mask.width(); ++x) {
      const bool a = full.mask.row<std::uint8_t>(y)[x] >= 128, b = fast.mask.row<std::uint8_t>(y)[x] >= 128;
      both += a && b, either += a || b;
      for (int c = 0; c < 3; ++c)
        error += std::abs(full.picture.row<std::uint8_t>(y)[3 * x + c] - fast.picture.row<std::uint8_t>(y)[3 * x + c]);
    }
  EXPECT_GT(both / either, .985);
  EXPECT_LT(error / (3. * 601 * full.mask.height()), 2.5);
}

TEST(Photographer, SaysWhatItCanNotDo) {
  Job job;
  Scene scene = make_scene(make_box(.4), kBluePaint, true, 1);
  const Photographer photographer(scene, coarse_light(), job);
  View view = view_of(scene, default_camera(60), 0);
  PhotoOptions options;
  options.rays = 0;
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, options, 1, job); }).code(),
            ErrorCode::invalid_argument);
  options = {};
  options.exposure = NAN;
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, options, 1, job); }).code(),
            ErrorCode::invalid_argument);
  view.cam_from_world = look_at({100, 0, 1}, {0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, {}, 1, job); }).code(), ErrorCode::invalid_argument);
  view.cam_from_world = look_at({0, 0, .01}, {1, 0, 0}, {0, 0, 1});  // inside the pedestal
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, {}, 1, job); }).code(), ErrorCode::invalid_argument);
  scene.enclosure.panels = 2;
  EXPECT_EQ(test::expect_error([&] { Photographer(scene, coarse_light(), job); }).code(), ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lumihull::rig
