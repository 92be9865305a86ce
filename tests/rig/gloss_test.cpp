#include <Eigen/Geometry>
#include <cmath>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A black, glossy ball in a black room under one lamp: all that a photograph shows is the highlight.
Scene dark_room(double roughness) {
  Object ball = make_sphere(.4, 6);
  ball.material.pattern = Pattern::plain;
  ball.material.colors[0] = {0, 0, 0};
  ball.material.grain = 0;
  ball.material.reflectance = .5f;
  ball.material.roughness = float(roughness);
  Scene scene = make_scene(ball, {0, 0, 0}, false, 1);
  scene.enclosure.ceiling = {0, 0, 0};
  scene.ambient = {0, 0, 0};
  scene.lamps.resize(1);
  scene.lamps[0].radius = .02f;
  scene.lamps[0].intensity *= .1f;
  return scene;
}

/// Where a sphere mirrors the lamp to the eye: there the normal halves the angle between both (Alhazen's problem), by
/// fixed-point iteration, which contracts for points well outside the sphere.
Vector3d mirror_point(const Vector3d& center, double radius, const Vector3d& lamp, const Vector3d& eye) {
  Vector3d p = center + radius * ((lamp - center).normalized() + (eye - center).normalized()).normalized();
  for (int i = 0; i < 200; ++i) p = center + radius * ((lamp - p).normalized() + (eye - p).normalized()).normalized();
  return p;
}

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
    const Vector3d expected = mirror_point(center, .2, lamp, view.center());
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

}  // namespace
}  // namespace lumihull::rig
