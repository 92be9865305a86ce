// The camera's lens and shutter: blur against the thin lens' formula, motion against its length, and both on prints.

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// A glowing ball in a black room, in front of a camera at height 1 that looks along +x.
struct Glow {
  double distance, radius = .016 * distance;
  Scene scene;
  View view;

  explicit Glow(double far) : distance(far) {
    Object ball = make_sphere(2 * radius, 5);
    ball.material.unlit = true;
    ball.material.colors[0] = Vector3f::Ones();
    for (Vector3f& v : ball.mesh.vertices) v += Vector3f(float(far), 0, float(1 - radius));
    scene.objects = {ball};
    scene.enclosure.color = scene.enclosure.ceiling = Vector3f::Zero();
    view = {sensor_camera(240, 18, 22.7, 0), look_at({0, 0, 1}, {1, 0, 1}, {0, 0, 1})};
  }
  double diameter_px() const { return 2 * radius * view.camera.f / distance; }
};

struct Spot {
  double sum = 0;
  Vector2d middle{0, 0}, variance{0, 0};
};

template <typename Value>
Spot spot(int width, int height, Value&& value) {
  Spot s;
  Vector2d square(0, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double v = value(x, y);
      const Vector2d at(x + .5, y + .5);
      s.sum += v, s.middle += v * at, square += v * at.cwiseAbs2();
    }
  s.middle /= s.sum;
  s.variance = square / s.sum - s.middle.cwiseAbs2();
  return s;
}

Spot mask_spot(const Photo& photo) {
  return spot(photo.mask.width(), photo.mask.height(),
              [&](int x, int y) { return photo.mask.row<std::uint8_t>(y)[x] / 255.; });
}

double linear(const Image& picture, int x, int y) {
  return linear_from_srgb(picture.row<std::uint8_t>(y)[3 * x + 1] / 255.f);
}

// The picture holds integrals over pixels' squares: 1/12 px² along each axis; a sharp edge's aliasing is below .06.
constexpr double kPixel = 1. / 12;

TEST(Lens, TheCircleOfConfusionIsTheThinLens) {
  Job job;
  for (const auto& [distance, focus] : {std::pair{.5, 1.}, std::pair{2., .8}, std::pair{1., 1.}})
    for (const double f_number : {.5, 1.}) {
      SCOPED_TRACE(testing::Message() << distance << " m, sharp at " << focus << " m, f/" << f_number);
      const Glow glow(distance);
      const Photographer photographer(glow.scene, test::coarse_light(), job);
      PhotoOptions options = test::noiseless();
      options.f_number = f_number;
      options.focus_m = focus;
      options.edge_rays = 16;
      const Spot s = mask_spot(photographer.photograph(glow.view, options, 1, job));
      // Textbook: c = A F |z - s| / (z (s - F)), here with sensor_camera's 18 mm from lens to sensor.
      const double image = .018, focal = 1 / (1 / image + 1 / focus), opening = focal / f_number;
      const double confusion_m = opening * focal * std::fabs(distance - focus) / (distance * (focus - focal));
      const double confusion = confusion_m / (22.7e-3 / 240), ball = glow.diameter_px();
      // A uniform disc has variance d² / 16 along each axis; that of a convolution is the sum.
      const double expected = confusion * confusion / 16 + ball * ball / 16 + kPixel;
      EXPECT_NEAR(s.variance.x() / expected, 1, .03);
      EXPECT_NEAR(s.variance.y() / expected, 1, .03);
      EXPECT_LT((s.middle - Vector2d(120, 80)).norm(), .06);
      EXPECT_NEAR(s.sum / (M_PI * ball * ball / 4), 1, .03);  // light is spread, not lost
    }
}

TEST(Lens, MotionSpreadsALineAsLongAsItself) {
  Job job;
  const Glow glow(1);
  const Photographer photographer(glow.scene, test::coarse_light(), job);
  PhotoOptions options = test::noiseless();
  options.edge_rays = 16;
  const double ball = glow.diameter_px();
  const Pose& pose = glow.view.cam_from_world;
  // To the right by 12 px at 1 m, in one step and in unequal numbers of steps; then turning.
  for (const int moments : {2, 5}) {
    SCOPED_TRACE(moments);
    std::vector<Pose> during;
    const double step = 12 / glow.view.camera.f;
    for (int i = 0; i < moments; ++i)
      during.push_back(Pose{Eigen::Quaterniond::Identity(), {step * (double(i) / (moments - 1) - .5), 0, 0}} * pose);
    const Spot s = mask_spot(photographer.photograph(glow.view, options, 1, job, during));
    EXPECT_NEAR(s.variance.x(), 144. / 12 + ball * ball / 16 + kPixel, .15);
    EXPECT_NEAR(s.variance.y(), ball * ball / 16 + kPixel, .06);
    EXPECT_LT((s.middle - Vector2d(120, 80)).norm(), .06);
  }
  std::vector<Pose> turning;
  const double angle = std::atan(8 / glow.view.camera.f);
  for (const double t : {-1., 0., 1.})
    turning.push_back(Pose{Eigen::Quaterniond(Eigen::AngleAxisd(t * angle, Vector3d::UnitX())), {0, 0, 0}} * pose);
  const Spot s = mask_spot(photographer.photograph(glow.view, options, 1, job, turning));
  EXPECT_NEAR(s.variance.y(), 256. / 12 + ball * ball / 16 + kPixel, .25);
  EXPECT_NEAR(s.variance.x(), ball * ball / 16 + kPixel, .06);
}

TEST(Lens, PrintsAreBlurredAsObjectsAre) {
  Job job;
  Scene scene;
  scene.enclosure.color = scene.enclosure.ceiling = Vector3f::Zero();
  scene.enclosure.radius = 2;
  scene.lamps = {{{0, 0, 1}, .05f, {1, 1, 1}}};
  FlatPrint print;
  print.low = {-.3, -.3}, print.high = {.3, .3};
  print.paper = {0, 0, 0};
  FlatShape disc;
  disc.color = Vector3f::Constant(.9f), disc.radius = .02;
  print.shapes = {disc};
  // On the panel at +x: half an edge angle turned.
  const double turn = M_PI / 8;
  const Vector3d out(std::cos(turn), std::sin(turn), 0);
  print.world_from_print = look_at(2 * out + Vector3d(0, 0, 1), 3 * out + Vector3d(0, 0, 1), {0, 0, 1}).inverse();
  scene.sheets = {print};
  LightOptions light = test::coarse_light();
  const Photographer photographer(scene, light, job);
  const View view{sensor_camera(240, 18, 22.7, 0), look_at({0, 0, 1}, out + Vector3d(0, 0, 1), {0, 0, 1})};
  PhotoOptions options = test::noiseless();
  options.blur_px = .7;
  options.exposure = 1.5;
  const auto measured = [&](std::span<const Pose> during) {
    const Image picture = photographer.photograph(view, options, 1, job, during).picture;
    return spot(picture.width(), picture.height(), [&](int x, int y) { return linear(picture, x, y); });
  };
  const Spot sharp = measured({});
  ASSERT_GT(sharp.sum, 1);
  EXPECT_LT((sharp.middle - Vector2d(120, 80)).norm(), .02);
  options.f_number = 1, options.focus_m = 1;
  const double opening = 1 / (1 / .018 + 1 / 1.), confusion = view.camera.f * opening * (1 - 1 / 2.);
  const Spot soft = measured({});
  EXPECT_NEAR(soft.variance.x() - sharp.variance.x(), confusion * confusion / 16, .02);
  EXPECT_NEAR(soft.variance.y() - sharp.variance.y(), confusion * confusion / 16, .02);
  EXPECT_NEAR(soft.sum / sharp.sum, 1, .01);
  options.f_number = 0;
  std::vector<Pose> during;
  for (const double t : {-.5, .5})
    during.push_back(Pose{Eigen::Quaterniond::Identity(), {t * 9 * 2 / view.camera.f, 0, 0}} * view.cam_from_world);
  const Spot moved = measured(during);
  EXPECT_NEAR(moved.variance.x() - sharp.variance.x(), 81. / 12, .1);
  EXPECT_NEAR(moved.variance.y(), sharp.variance.y(), .02);
  EXPECT_LT((moved.middle - Vector2d(120, 80)).norm(), .02);
}

TEST(Lens, TwoSeedsComeTogetherAsRaysGrow) {
  Job job;
  Object object = make_box(.4);
  const Scene scene = make_scene(object, kGreenPaint, false, 1);
  const Photographer photographer(scene, test::coarse_light(), job);
  const View view = test::view_of(scene, default_camera(120), 2);
  PhotoOptions options = test::noiseless();
  options.f_number = .7, options.focus_m = .5;
  double previous = 0;
  for (const int n : {2, 4, 8}) {
    SCOPED_TRACE(n);
    options.rays = options.edge_rays = n;
    const Image a = photographer.photograph(view, options, 1, job).picture;
    const Image b = photographer.photograph(view, options, 2, job).picture;
    double sum = 0;
    for (int y = 0; y < a.height(); ++y)
      for (int x = 0; x < a.width(); ++x) sum += std::pow(linear(a, x, y) - linear(b, x, y), 2);
    const double rms = std::sqrt(sum / (a.width() * a.height()));
    // Four times the rays: at least half the difference, as for independent ones; more because they are stratified.
    if (previous > 0) {
      EXPECT_LT(rms, .56 * previous);
      EXPECT_GT(rms, .1 * previous);
    }
    previous = rms;
  }
}

TEST(Lens, WideOpenOrMovingThreadsDoNotChangeABit) {
  Job one({}, 1), three({}, 3);
  const Scene scene = make_scene(make_box(.4), kGreenPaint, false, 1);
  const Photographer photographer(scene, test::coarse_light(), one);
  const View view = test::view_of(scene, default_camera(96), 2);
  PhotoOptions options;
  options.f_number = 2, options.bayer = true;
  const std::vector<Pose> during{view.cam_from_world,
                                 Pose{Eigen::Quaterniond::Identity(), {.01, 0, 0}} * view.cam_from_world};
  const Photo a = photographer.photograph(view, options, 5, one, during);
  EXPECT_TRUE(test::same_bytes(a.picture, photographer.photograph(view, options, 5, three, during).picture));
  EXPECT_FALSE(test::same_bytes(a.picture, photographer.photograph(view, options, 5, three).picture));
}

TEST(Sensor, AMosaicKeepsOneColourAPixelAndGuessesTheOthers) {
  Job job;
  const Scene scene = make_scene(make_box(.4), kGreenPaint, false, 1);
  const Photographer photographer(scene, test::coarse_light(), job);
  const View view = test::view_of(scene, default_camera(96), 2);
  PhotoOptions options = test::noiseless();
  const Image full = photographer.photograph(view, options, 5, job).picture;
  options.bayer = true;
  const Image mosaic = photographer.photograph(view, options, 5, job).picture;
  int other = 0, differ = 0;
  for (int y = 0; y < full.height(); ++y)
    for (int x = 0; x < full.width(); ++x)
      for (int c = 0; c < 3; ++c) {
        const int a = full.row<std::uint8_t>(y)[3 * x + c], b = mosaic.row<std::uint8_t>(y)[3 * x + c];
        if (c == (y & 1) + (x & 1))
          ASSERT_EQ(a, b) << x << " " << y << " " << c;
        else
          ++other, differ += a != b;
      }
  EXPECT_GT(differ, other / 10);
}

TEST(Lens, SaysWhatItCanNotDo) {
  Job job;
  const Scene scene = make_scene(make_box(.4), kGreenPaint, false, 1);
  const Photographer photographer(scene, test::coarse_light(), job);
  const View view = test::view_of(scene, default_camera(60), 2);
  for (const auto& wrong : {std::pair{.1, 0.}, std::pair{-2., 0.}, std::pair{double(NAN), 0.}, std::pair{8., -1.}}) {
    PhotoOptions options;
    options.f_number = wrong.first, options.focus_m = wrong.second;
    EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, options, 1, job); }).code(),
              ErrorCode::invalid_argument);
  }
  const std::vector<Pose> outside{look_at({100, 0, 1}, {0, 0, 0}, {0, 0, 1})};
  EXPECT_EQ(test::expect_error([&] { photographer.photograph(view, {}, 1, job, outside); }).code(),
            ErrorCode::invalid_argument);
  EXPECT_EQ(test::expect_error([] { sensor_camera(3072, 0); }).code(), ErrorCode::invalid_argument);
}

TEST(SensorCamera, HasThePapersFieldsOfView) {
  for (const auto& [focal, degrees] : {std::pair{18., 64.47}, std::pair{10., 97.22}}) {
    const Camera camera = sensor_camera(3072, focal, 22.7, 0);
    EXPECT_EQ(camera.height, 2048);
    EXPECT_NEAR(2 * std::atan(camera.width / (2 * camera.f)) * 180 / M_PI, degrees, .02);
  }
}

}  // namespace
}  // namespace lumihull::rig
