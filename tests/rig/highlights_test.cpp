#include <lumihull/base/files.h>
#include <lumihull/hull/simplify.h>
#include <lumihull/rig/highlights.h>
#include <lumihull/rig/rig_capture.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/highlights.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/pipeline.h>
#include <lumihull/slf/renderer.h>

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

float light_of(const Image& picture, int x, int y, int channel) {
  return linear_from_srgb(float(picture.row<std::uint8_t>(y)[3 * x + channel]) / 255);
}

TEST(Highlights, APhotographIsTheSumOfItsParts) {
  const Scene scene = make_scene(make_pebble(.6, 4), kGreenPaint, true, 3);
  Job job;
  const Photographer photographer(scene, test::coarse_light(), job);
  PhotoOptions options = test::noiseless();
  const View view = test::view_of(scene, default_camera(240), 1);
  const auto take = [&](Shown shown) {
    options.shown = shown;
    return photographer.photograph(view, options, 1, job);
  };
  const Photo all = take(Shown::all), without = take(Shown::without_highlights), alone = take(Shown::highlights_alone);
  int bright = 0;
  for (int y = 0; y < all.picture.height(); ++y)
    for (int x = 0; x < all.picture.width(); ++x)
      for (int c = 0; c < 3; ++c) {
        const float a = light_of(without.picture, x, y, c), b = light_of(alone.picture, x, y, c);
        const float sum = light_of(all.picture, x, y, c);
        EXPECT_NEAR(std::min(1.f, a + b), sum, .012) << x << ", " << y;  // each is rounded to a byte
        bright += b > .2f;
        if (all.mask.row<std::uint8_t>(y)[x] == 0) {
          EXPECT_EQ(b, 0);
        }
      }
  EXPECT_GT(bright, 20);
  ASSERT_EQ(all.mask.bytes(), without.mask.bytes());
  EXPECT_EQ(std::memcmp(all.mask.data(), without.mask.data(), all.mask.bytes()), 0);
}

/// The bust has many highlights of each lamp, that come, go and pass one another.
TEST(Highlights, PhotographsOfABustFollowThemAndItsMeanColourDoesNot) {
  const test::TemporaryFolder folder;
  Job job;
  RigOptions o;
  o.object = "bust";
  o.photos = 16, o.empty_photos = 1, o.test_views = 8;
  o.width = 480;
  o.light = test::coarse_light();
  Capture capture = make_capture(folder / "c", o, job);
  const std::filesystem::path truth = folder / "c" / "truth", views = truth / "test_views";
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    capture.write_mask(i, read_image(truth / "masks" / (capture.shots[i].name + ".png")), MaskSource::imported);
  const hull::Mesh mesh = hull::read_mesh(truth / "mesh.ply");
  hull::write_mesh(capture.hull_path(), hull::simplify(mesh, {6000, 0}, job).mesh);
  slf::run_stage(capture, "texture", job);
  const slf::TexturedMesh mean = slf::read_glb(folder / "c" / "textured.glb");
  const hull::RayScene scene(mean.mesh);
  slf::HighlightJudge judge(mesh);
  for (const slf::PathView& v : slf::read_camera_path(truth / "test_views.json")) {
    const Image mask = read_image(views / "masks" / (v.name + ".png"));
    const auto picture = [&](const char* of) {
      return slf::composited(read_image(views / of / (v.name + ".png")), mask, {0, 0, 0});
    };
    // As a camera would deliver it.
    write_file(folder / "photograph.jpg", encode_jpeg(read_image(views / (v.name + ".png")), 90));
    const Image photograph = read_image(folder / "photograph.jpg");
    judge.add_view(v.view, picture("without_highlights"), picture("highlights"),
                   slf::composited(photograph, mask, {0, 0, 0}));
    judge.add_picture("mean",
                      slf::composited(slf::render_texture(mean, scene, v.view, {2, false}, job).rgba, {0, 0, 0}));
  }
  const auto paths = judge.paths();
  ASSERT_EQ(paths.count("mean"), 1u);
  const slf::HighlightPath &photograph = paths.at("photograph"), &texture = paths.at("mean");
  EXPECT_GT(photograph.tracks, 8u);
  EXPECT_GT(photograph.true_length_px, 100);
  EXPECT_GT(photograph.share, .95);
  EXPECT_LT(photograph.rms_px, 1);
  EXPECT_LT(texture.share, .12) << texture.found << " of " << texture.places;
}

}  // namespace
}  // namespace lumihull::rig
