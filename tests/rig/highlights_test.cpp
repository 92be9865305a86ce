#include <lumihull/rig/highlights.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

bool faces(const Vector3d& point, const Vector3d& normal, const Vector3d& other) {
  return normal.dot(other - point) > 0;
}

/// How far the found highlights' pixels are from the expected places; each lamp has one exactly where one is expected.
double worst_error(const std::vector<Highlight>& found, const View& view, const std::map<int, Vector3d>& expected) {
  EXPECT_EQ(found.size(), expected.size());
  double worst = 0;
  for (const Highlight& h : found) {
    if (!expected.contains(h.lamp)) {
      ADD_FAILURE() << "lamp " << h.lamp << " has no highlight";
      continue;
    }
    const auto pixel = view.project(expected.at(h.lamp));
    EXPECT_TRUE(pixel);
    worst = std::max(worst, (*pixel - h.pixel).norm());
    EXPECT_LT((*view.project(h.point) - h.pixel).norm(), 1e-9);
    EXPECT_NEAR(h.depth, (view.cam_from_world * h.point).z(), 1e-12);
    EXPECT_GT(h.strength, 0);
  }
  return worst;
}

/// Where light is mirrored, and the surface's normal there.
struct Mirror {
  Vector3d point, normal;
};

/// In eight views, three lamps' highlights are where `mirror(lamp, eye)` says, those that both sides of it see.
void expect_found(const Scene& scene, const std::function<Mirror(const Vector3d&, const Vector3d&)>& mirror) {
  ASSERT_EQ(scene.lamps.size(), 3u);
  const HighlightFinder finder(scene);
  ASSERT_TRUE(finder.any());
  std::size_t seen = 0;
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    const View view = test::view_of(scene, default_camera(1536), i);
    std::map<int, Vector3d> expected;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d lamp = scene.lamps[k].position.cast<double>();
      const Mirror m = mirror(lamp, view.center());
      if (faces(m.point, m.normal, view.center()) && faces(m.point, m.normal, lamp)) expected[int(k)] = m.point;
    }
    seen += expected.size();
    EXPECT_LT(worst_error(finder.find(view), view, expected), .05);
  }
  EXPECT_GT(seen, 12u);
}

TEST(Highlights, OnABallAreAlhazensPoints) {
  const Scene scene = make_scene(make_sphere(.4, 6), kGreenPaint, false, 3);
  const Vector3d center = scene.center().cast<double>();
  expect_found(scene, [&](const Vector3d& lamp, const Vector3d& eye) {
    const Vector3d p = test::sphere_mirror_point(center, .2, lamp, eye);
    return Mirror{p, p - center};
  });
}

/// The pebble's point of the shortest way from eye to lamp (Fermat): down the length's gradient along the surface, each
/// step brought back to it along the formula's gradient.
Mirror pebble_mirror_point(double size, const Vector3d& foot, const Vector3d& lamp, const Vector3d& eye) {
  Vector3d p = (lamp - foot).normalized() + (eye - foot).normalized();
  p = foot + Vector3d(0, 0, .33 * size) + .4 * size * p.normalized();
  Vector3d gradient, normal;
  for (int i = 0; i < 20'000; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double f = pebble_function((p - foot) / size, &gradient);
      p -= size * f * gradient / gradient.squaredNorm();
    }
    normal = gradient.normalized();
    Vector3d way = (p - eye).normalized() + (p - lamp).normalized();
    way -= normal * normal.dot(way);
    p -= .05 * size * way;
    if (way.norm() < 1e-13) break;
  }
  return {p, normal};
}

TEST(Highlights, OnThePebbleAreWhereTheFormulaSays) {
  const double size = .6;
  const Scene scene = make_scene(make_pebble(size), kGreenPaint, true, 3);
  const Vector3d foot(0, 0, scene.enclosure.pedestal_height);
  expect_found(scene,
               [&](const Vector3d& lamp, const Vector3d& eye) { return pebble_mirror_point(size, foot, lamp, eye); });
}

TEST(Highlights, AreTheBrightestPointsOfPhotographsOfGlossAlone) {
  const Scene scene = test::in_the_dark(make_pebble(.6), .2);
  const HighlightFinder finder(scene);
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  int photographs = 0;
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    const View view = test::view_of(scene, default_camera(480), i);
    const auto found = finder.find(view);
    if (found.empty()) continue;
    ASSERT_EQ(found.size(), 1u);
    PhotoOptions options = test::noiseless();
    options.exposure = .8 / found[0].strength;  // white is the lamp's gloss there, and a little
    const Image picture = photographer.photograph(view, options, 1, job).picture;
    const auto light = [&](int x, int y) {
      return double(linear_from_srgb(picture.row<std::uint8_t>(y)[3 * x + 1] / 255.f));
    };
    double brightest = 0, weight = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) brightest = std::max(brightest, light(x, y));
    Vector2d middle(0, 0);
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x)
        if (light(x, y) > .9 * brightest) {
          weight += light(x, y);
          middle += light(x, y) * Vector2d(x + .5, y + .5);
        }
    // The strength is the brightness, but for a pixel's mean; seen flatly, the brightest place is a little beside the
    // mirror point (Fresnel's reflectance, masking).
    EXPECT_NEAR(brightest, .8, .08);
    EXPECT_LT((middle / weight - found[0].pixel).norm(), .7) << middle.transpose() / weight;
    ++photographs;
  }
  EXPECT_GE(photographs, 5);
}

TEST(Highlights, AreGoneWhereSomethingStandsBetween) {
  Scene scene = make_scene(make_pebble(.6, 5), kGreenPaint, false, 3);
  const View view = test::view_of(scene, default_camera(600), 0);
  const auto all = HighlightFinder(scene).find(view);
  ASSERT_EQ(all.size(), 3u);
  const auto with_ball_at = [&](const Vector3d& place) {
    Scene more = scene;
    Object ball = make_sphere(.06, 3);
    ball.material.reflectance = 0;
    for (auto& v : ball.mesh.vertices) v += (place - Vector3d(0, 0, .03)).cast<float>();
    more.objects.push_back(ball);
    return HighlightFinder(more).find(view);
  };
  const Vector3d lamp = scene.lamps[1].position.cast<double>();
  const auto shadowed = with_ball_at(all[1].point + .7 * (lamp - all[1].point));
  const auto hidden = with_ball_at(all[1].point + .5 * (view.center() - all[1].point));
  for (const auto& left : {shadowed, hidden}) {
    ASSERT_EQ(left.size(), 2u);
    EXPECT_EQ(left[0].lamp, 0);
    EXPECT_EQ(left[1].lamp, 2);
    EXPECT_EQ(left[0].pixel, all[0].pixel);
  }
  // Out of the picture: the same place, looking elsewhere.
  const View away{view.camera, look_at(view.center(), 2 * view.center() - all[0].point, {0, 0, 1})};
  EXPECT_TRUE(HighlightFinder(scene).find(away).empty());
}

TEST(Highlights, MattAndUnlitThingsHaveNone) {
  Scene scene = make_scene(make_pebble(.6, 3), kGreenPaint, false, 3);
  const View view = test::view_of(scene, default_camera(600), 0);
  EXPECT_EQ(HighlightFinder(scene).find(view).size(), 3u);
  scene.objects[0].material.unlit = true;
  EXPECT_FALSE(HighlightFinder(scene).any());
  EXPECT_TRUE(HighlightFinder(scene).find(view).empty());
  scene.objects[0].material.unlit = false;
  scene.objects[0].material.reflectance = 0;
  EXPECT_FALSE(HighlightFinder(scene).any());
  EXPECT_TRUE(HighlightFinder(scene).find(view).empty());
  EXPECT_TRUE(HighlightFinder(scene.emptied()).find(view).empty());
}

TEST(Highlights, ABumpyThingHasSeveralTheStrongestFirst) {
  const Scene scene = make_scene(make_vase(.6, 60), kGreenPaint, false, 3);
  const auto found = HighlightFinder(scene).find(test::view_of(scene, default_camera(600), 1));
  EXPECT_GT(found.size(), 6u);
  for (std::size_t i = 1; i < found.size(); ++i) {
    ASSERT_GE(found[i].lamp, found[i - 1].lamp);
    if (found[i].lamp == found[i - 1].lamp) {
      EXPECT_LE(found[i].strength, found[i - 1].strength);
      EXPECT_NE(found[i].point, found[i - 1].point);
    }
  }
}

}  // namespace
}  // namespace lumihull::rig
