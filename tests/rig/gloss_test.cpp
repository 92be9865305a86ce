#include <Eigen/Geometry>
#include <cmath>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Scene dark_room(double roughness) { return test::in_the_dark(make_sphere(.4, 6), roughness); }

struct Highlight {
  Vector2d middle{0, 0};
  double brightest = 0;
  int pixels = 0;  ///< at least half as bright as the brightest
};

Highlight find_highlight(const Image& picture) {
  Highlight h;
  const auto light = [&](int x, int y) {
    return double(linear_from_srgb(picture.row<std::uint8_t>(y)[3 * x + 1] / 255.f));
  };
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) h.brightest = std::max(h.brightest, light(x, y));
  double weight = 0;
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      if (light(x, y) < .5 * h.brightest) continue;
      ++h.pixels;
      weight += light(x, y);
      h.middle += light(x, y) * Vector2d(x + .5, y + .5);
    }
  h.middle /= weight;
  return h;
}

TEST(Gloss, TheHighlightTakesThePathOfTheMirrorPoint) {
  const Scene scene = dark_room(.25);
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  const Vector3d center = scene.center().cast<double>(), lamp = scene.lamps[0].position.cast<double>();
  const Camera camera = default_camera(360);
  Hemisphere around;
  around.target = center;
  around.radius = framing_distance(camera, scene.radius(), .8);
  around.phi_last = 1.0;
  around.jitter = 0;
  // A quarter circle of cameras around the lamp's side.
  const double azimuth = std::atan2(lamp.y(), lamp.x());
  Vector3d previous = Vector3d::Zero();
  double travelled = 0;
  for (int i = 0; i < 7; ++i) {
    SCOPED_TRACE(i);
    const double theta = azimuth - .8 + 1.6 * i / 6;
    const Vector3d out(std::sin(1.0) * std::cos(theta), std::sin(1.0) * std::sin(theta), std::cos(1.0));
    const View view{camera, look_at(center + around.radius * out, center, {0, 0, 1})};
    PhotoOptions options = test::noiseless();
    options.exposure = .3;  // the highlight is not clipped
    Photo photo = photographer.photograph(view, options, 1, job);
    const Highlight found = find_highlight(photo.picture);
    ASSERT_GT(found.brightest, .02);
    const Vector3d expected = test::sphere_mirror_point(center, .2, lamp, view.center());
    const auto px = view.project(expected);
    ASSERT_TRUE(px);
    // The lobe is slightly lopsided (masking, Fresnel, distance), hence not zero.
    EXPECT_LT((found.middle - *px).norm(), 1.0) << found.middle.transpose() << " / " << px->transpose();
    if (i > 0) travelled += (expected - previous).norm();
    previous = expected;
  }
  // On the surface it moves about half as far as the camera turns: a painted spot would not.
  EXPECT_GT(travelled, .1);
}

TEST(Gloss, RoughnessWidensAndDimsTheHighlight) {
  Job job;
  const Camera camera = default_camera(360);
  Highlight previous;
  for (const double roughness : {.2, .35, .5}) {
    SCOPED_TRACE(roughness);
    const Scene scene = dark_room(roughness);
    const Photographer photographer(scene, test::coarse_light(), job);
    const Vector3d center = scene.center().cast<double>();
    Vector3d out = scene.lamps[0].position.cast<double>() - center;
    out = Vector3d(-out.y(), out.x(), out.z()).normalized();
    const View view{camera, look_at(center + .7 * out, center, {0, 0, 1})};
    PhotoOptions options = test::noiseless();
    options.exposure = .08;  // not clipped at the smallest roughness
    const Highlight h = find_highlight(photographer.photograph(view, options, 1, job).picture);
    ASSERT_LT(h.brightest, .95);
    if (previous.pixels > 0) {
      EXPECT_GT(h.pixels, 1.5 * previous.pixels);
      EXPECT_LT(h.brightest, previous.brightest);
    }
    previous = h;
  }
}

TEST(Gloss, AMattBallHasNone) {
  Scene scene = dark_room(.2);
  scene.objects[0].material.reflectance = 0;
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  const View view = test::view_of(scene, default_camera(120), 0);
  EXPECT_EQ(find_highlight(photographer.photograph(view, test::noiseless(), 1, job).picture).brightest, 0);
}

TEST(Gloss, TheCeilingsReflectionHasSoftEdgesWhereAsked) {
  Job job;
  double steepest[2], mean[2];
  for (const bool soft : {false, true}) {
    Scene scene = dark_room(.3);
    scene.enclosure.ceiling = {1, 1, 1};
    scene.lamps.clear();
    scene.objects[0].material.reflectance = .1f;
    scene.objects[0].material.soft_mirror = soft;
    const Photographer photographer(scene, test::coarse_light(), job);
    const Camera camera = default_camera(240);
    const Vector3d center = scene.center().cast<double>();
    const View view{camera, look_at(center + Vector3d(.1, 0, .8), center, {0, 1, 0})};
    PhotoOptions options = test::noiseless();
    options.exposure = 5;
    const Photo photo = photographer.photograph(view, options, 1, job);
    double sum = 0, count = 0, step = 0;
    const auto light = [&](int x, int y) {
      return linear_from_srgb(photo.picture.row<std::uint8_t>(y)[3 * x] / 255.f);
    };
    for (int y = 0; y < photo.mask.height(); ++y)
      for (int x = 1; x < photo.mask.width(); ++x) {
        // Facing the camera, far from the outline, where Fresnel's reflection is steep by itself.
        if (Vector2d(x - camera.u0, y - camera.v0).norm() > 45) continue;
        ASSERT_EQ(photo.mask.row<std::uint8_t>(y)[x], 255);
        sum += light(x, y), count += 1;
        step = std::max(step, double(std::fabs(light(x, y) - light(x - 1, y))));
      }
    steepest[soft] = step, mean[soft] = sum / count;
  }
  EXPECT_GT(steepest[0], .1);
  EXPECT_LT(steepest[1], .35 * steepest[0]);
  EXPECT_NEAR(mean[1] / mean[0], 1, .1);
}

}  // namespace
}  // namespace lumihull::rig
