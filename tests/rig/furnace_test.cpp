// Light that must come out right: furnaces, in which all is equally bright, and lobes against numeric integration.

#include <algorithm>
#include <cmath>

#include "objects/material.h"
#include "objects/noise.h"
#include "rig_support.h"

namespace lumihull::rig {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// An object in a tent whose walls glow evenly and reflect `paint`.
Scene tent(Object object, float glow, float paint, float ceiling) {
  Scene scene;
  object.material.pattern = Pattern::plain;
  object.material.grain = 0;
  scene.objects = {std::move(object)};
  for (Vector3f& v : scene.objects[0].mesh.vertices) v.z() += 1;
  scene.enclosure.color = Vector3f::Constant(paint);
  scene.enclosure.glow = Vector3f::Constant(glow);
  scene.enclosure.ceiling = Vector3f::Constant(ceiling);
  scene.enclosure.unevenness = 0;
  return scene;
}

struct Range {
  double low = INFINITY, high = -INFINITY;
  int covered = 0;
};

/// The linear value of the byte 188: what has it is not rounded.
const double kMiddle = linear_from_srgb(188 / 255.f);

/// The radiances that a photograph shows, in 8 bits: steps of half a percent.
Range radiances(const Scene& scene, double exposure, int bounces, bool object_only, int i) {
  Job job;
  LightOptions light = test::coarse_light();
  light.ambient_rays = 16, light.vertex_spacing = .05f, light.bounces = bounces;
  const Photographer photographer(scene, light, job);
  PhotoOptions options = test::noiseless();
  options.exposure = exposure;
  const Photo photo = photographer.photograph(test::view_of(scene, default_camera(120), i), options, 1, job);
  Range range;
  for (int y = 0; y < photo.mask.height(); ++y)
    for (int x = 0; x < photo.mask.width(); ++x) {
      const bool covered = photo.mask.row<std::uint8_t>(y)[x] == 255;
      range.covered += covered;
      if (object_only && !covered) continue;
      for (int c = 0; c < 3; ++c) {
        const double v = linear_from_srgb(photo.picture.row<std::uint8_t>(y)[3 * x + c] / 255.f) / exposure;
        range.low = std::min(range.low, v), range.high = std::max(range.high, v);
      }
    }
  return range;
}

TEST(Furnace, AWhiteObjectInUniformLightDisappears) {
  for (const float reflectance : {0.f, .04f, .5f})
    for (const int view : {0, 3}) {
      SCOPED_TRACE(testing::Message() << reflectance << " " << view);
      Object object = make_vase(.5, 40);  // with a hollow neck and a handle: light comes and goes between its parts
      object.material.colors[0] = Vector3f::Ones();
      object.material.reflectance = reflectance;
      const Range r = radiances(tent(object, 1, 0, 1), kMiddle, 1000, false, view);
      EXPECT_GT(r.covered, 500);
      EXPECT_NEAR(r.high, 1, .001);
      EXPECT_NEAR(r.low, 1, .001);
    }
}

TEST(Furnace, AConvexGreyObjectIsAsBrightAsItsAlbedo) {
  Object object = make_sphere(.5, 4);
  object.material.reflectance = 0;
  object.material.colors[0] = Vector3f::Constant(.5f);
  const Range r = radiances(tent(object, 1, 0, 1), 2 * kMiddle, 8, true, 1);
  EXPECT_GT(r.covered, 500);
  EXPECT_NEAR(r.low, .5, .001);
  EXPECT_NEAR(r.high, .5, .001);
}

TEST(Furnace, BouncesSumUpToTheGeometricSeries) {
  // Walls that glow with 1 and reflect a half, a ceiling that radiates their equilibrium, 1 / (1 - 1/2) = 2: all is 2.
  // An object that reflects all changes nothing.
  for (const int bounces : {1, 3, 30}) {
    SCOPED_TRACE(bounces);
    Object object = make_sphere(.5, 4);
    object.material.reflectance = 0;
    object.material.colors[0] = Vector3f::Ones();
    const Range r = radiances(tent(object, 1, .5f, 2), kMiddle / 2, bounces, false, 2);
    // Without the last bounces 1/2^n of what walls (not the ceiling) send is missing; a path ends below 1 %.
    const double missing = std::max(.02, 2 * std::pow(.5, bounces));
    EXPECT_LT(r.high, 2.02);
    EXPECT_GT(r.low, 2 - 1.1 * missing);
    if (bounces == 1) {
      EXPECT_LT(r.low, 1.9);
    }
  }
}

TEST(Furnace, AGreenFloorColoursAWhiteObjectFromBelow) {
  Object object = make_sphere(.4, 4);
  object.material.pattern = Pattern::plain;
  object.material.colors[0] = Vector3f::Constant(.8f);
  object.material.reflectance = 0;
  const Scene scene = make_scene(object, kGreenPaint, true, 1);
  Job job;
  LightOptions light = test::coarse_light();
  light.ambient_rays = 32;
  const Photographer photographer(scene, light, job);
  const Vector3d center = scene.center().cast<double>();
  const View view{default_camera(120), look_at(center + Vector3d(1.2, 0, .1), center, {0, 0, 1})};
  PhotoOptions options = test::noiseless();
  options.exposure = .7;
  const Photo photo = photographer.photograph(view, options, 1, job);
  const auto greenness = [&](double z) {
    const auto px = view.project(center + Vector3d(.19, 0, z));
    const std::uint8_t* p = photo.picture.row<std::uint8_t>(int(px->y())) + 3 * int(px->x());
    return linear_from_srgb(p[1] / 255.f) / linear_from_srgb(p[0] / 255.f);
  };
  EXPECT_GT(greenness(-.13), 1.2 * greenness(.13));
}

// E(v) = integral of the lobe over all directions of the light, with a mirror reflectance of 1: what a white furnace
// shows of a metal. By numeric integration of gloss(), and by sampling the visible normals (Heitz 2018): the mean of
// G2 / G1. They share no formula but the distribution's name.
TEST(Furnace, TheLobeLosesOnlyWhatSingleScatteringLoses) {
  for (const float roughness : {.3f, .5f, .8f, 1.f})
    for (const double cos_v : {1., .7, .3}) {
      SCOPED_TRACE(testing::Message() << "roughness " << roughness << ", cosine " << cos_v);
      Material material;
      material.reflectance = 1, material.roughness = roughness;
      const double alpha = roughness * roughness;
      const Vector3f n(0, 0, 1), v(float(std::sqrt(1 - cos_v * cos_v)), 0, float(cos_v));
      // Half vectors h on a grid that is uniform in the distribution's own measure; dω_l = 4 (v·h) dω_h.
      double lobe = 0;
      constexpr int kSteps = 300;
      for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
          const double u = (i + .5) / kSteps, phi = 2 * M_PI * (j + .5) / kSteps;
          const double cos2 = (1 - u) / (1 + (alpha * alpha - 1) * u), c = std::sqrt(cos2), s = std::sqrt(1 - cos2);
          const Vector3d h(s * std::cos(phi), s * std::sin(phi), c), w = v.cast<double>();
          const double vh = w.dot(h);
          const Vector3d l = 2 * vh * h - w;
          if (vh <= 0 || l.z() <= 0) continue;
          const double d = cos2 * (alpha * alpha - 1) + 1, density = alpha * alpha / (M_PI * d * d) * c;
          lobe += gloss(material, n, l.cast<float>(), v, 0) / M_PI * 4 * vh / density;
        }
      lobe /= double(kSteps) * kSteps;

      double sampled = 0;
      constexpr int kSamples = 40000;
      const Vector3d vd = v.cast<double>();
      const Vector3d stretched = Vector3d(alpha * vd.x(), alpha * vd.y(), vd.z()).normalized();
      const double across = std::hypot(stretched.x(), stretched.y());
      const Vector3d t1 =
          across > 1e-9 ? Vector3d(-stretched.y() / across, stretched.x() / across, 0) : Vector3d(1, 0, 0);
      const Vector3d t2 = stretched.cross(t1);
      const auto lambda = [&](double cosine) {
        return .5 * (std::sqrt(1 + alpha * alpha * (1 - cosine * cosine) / (cosine * cosine)) - 1);
      };
      for (int i = 0; i < kSamples; ++i) {
        const double r = std::sqrt((i + .5) / kSamples), phi = 2 * M_PI * unit_double(mix(7, std::uint64_t(i)));
        const double a = r * std::cos(phi), raw = r * std::sin(phi), share = .5 * (1 + stretched.z());
        const double b = (1 - share) * std::sqrt(1 - a * a) + share * raw;
        const Vector3d m = a * t1 + b * t2 + std::sqrt(std::max(0., 1 - a * a - b * b)) * stretched;
        const Vector3d h = Vector3d(alpha * m.x(), alpha * m.y(), std::max(1e-9, m.z())).normalized();
        const Vector3d l = 2 * vd.dot(h) * h - vd;
        if (l.z() > 0) sampled += (1 + lambda(vd.z())) / (1 + lambda(vd.z()) + lambda(l.z()));
      }
      sampled /= kSamples;
      EXPECT_NEAR(lobe, sampled, .01);
      EXPECT_LT(lobe, 1.003);
      // In closed form, where light and surface face one another on the roughest of surfaces.
      if (roughness == 1 && cos_v == 1) {
        EXPECT_NEAR(lobe, 1 - std::log(2.), .003);
      }
    }
}

}  // namespace
}  // namespace lumihull::rig
