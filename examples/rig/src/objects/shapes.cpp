// The objects that are made by formula. Each is a smooth union of simple bodies in a frame where the object is about
// one unit high, stands on z = 0 and looks towards -y.

#include <lumihull/base/error.h>
#include <lumihull/rig/object.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "icosphere.h"
#include "noise.h"
#include "solids.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector3f;

float vase_radius(float z) {
  static constexpr float kProfile[][2] = {{-.1f, .19f},  {0, .19f},     {.05f, .165f}, {.18f, .27f},
                                          {.40f, .335f}, {.60f, .28f},  {.76f, .15f},  {.87f, .135f},
                                          {.96f, .185f}, {1.05f, .21f}, {1.2f, .21f}};
  std::size_t i = 1;
  while (i + 3 < std::size(kProfile) && z > kProfile[i + 1][0]) ++i;
  // Cubic Hermite with finite-difference slopes.
  const auto slope = [&](std::size_t k) {
    return (kProfile[k + 1][1] - kProfile[k - 1][1]) / (kProfile[k + 1][0] - kProfile[k - 1][0]);
  };
  const float h = kProfile[i + 1][0] - kProfile[i][0], t = std::clamp((z - kProfile[i][0]) / h, 0.f, 1.f);
  const float t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * kProfile[i][1] + (t3 - 2 * t2 + t) * h * slope(i) +
         (3 * t2 - 2 * t3) * kProfile[i + 1][1] + (t3 - t2) * h * slope(i + 1);
}

float vase(const Vector3f& p) {
  const float r = std::hypot(p.x(), p.y()), theta = std::atan2(p.y(), p.x()), z = p.z();
  const float profile = vase_radius(z);
  const float belly = smoothstep(.12f, .26f, z) * (1 - smoothstep(.50f, .64f, z));
  const float ridges = .010f * std::cos(18 * theta) * belly + .004f * std::cos(95 * z) * smoothstep(.66f, .74f, z);
  float d = .75f * (r - profile - ridges);
  d = cut(d, z - 1, .02f);
  d = cut(d, -z, .02f);
  // The hollow neck: the hull can't see into it, as in life.
  const float hollow = cut(.75f * (r - profile + .042f), .80f - z, .03f);
  d = cut(d, -hollow, .012f);
  // The handle: an elliptic ring in the plane y = 0, half of it inside the body.
  const float ex = (p.x() - .27f) / .17f, ez = (z - .655f) / .20f;
  const float m = std::hypot(ex, ez);
  const float ring = m > 1e-6f ? (m - 1) * std::hypot(ex * .17f, ez * .20f) / m : -.17f;
  const float handle = std::hypot(ring, p.y() * .8f) - .027f;
  return blend(d, cut(handle, -(r - profile + .05f), .01f), .03f);
}

float bust(const Vector3f& p) {
  const Vector3f q(std::fabs(p.x()), p.y(), p.z());  // both halves are alike
  float d = ellipsoid(p, {0, .02f, .10f}, {.335f, .19f, .17f});
  d = blend(d, ellipsoid(p, {0, -.07f, .12f}, {.20f, .14f, .15f}), .06f);
  d = blend(d, capsule(p, {0, .03f, .15f}, {0, .005f, .50f}, .122f, .104f), .09f);
  d = blend(d, ellipsoid(p, {0, .01f, .74f}, {.172f, .205f, .225f}), .06f);              // skull
  d = blend(d, ellipsoid(p, {0, -.075f, .60f}, {.115f, .115f, .14f}), .06f);             // jaw
  d = blend(d, ellipsoid(p, {0, -.175f, .515f}, {.045f, .035f, .035f}), .04f);           // chin
  d = blend(d, capsule(p, {0, -.185f, .72f}, {0, -.245f, .645f}, .018f, .030f), .035f);  // nose
  d = blend(d, ellipsoid(q, {.07f, -.165f, .745f}, {.06f, .03f, .022f}), .03f);          // brows
  d = cut(d, -ellipsoid(q, {.075f, -.205f, .70f}, {.04f, .03f, .028f}), .03f);           // eye sockets
  d = blend(d, ellipsoid(q, {.07f, -.165f, .70f}, {.026f, .022f, .022f}), .01f);
  d = blend(d, ellipsoid(p, {0, -.195f, .583f}, {.05f, .022f, .013f}), .018f);  // lips
  d = blend(d, ellipsoid(p, {0, -.190f, .560f}, {.043f, .022f, .013f}), .018f);
  d = blend(d, ellipsoid(q, {.175f, .02f, .68f}, {.022f, .045f, .065f}), .02f);  // ears
  d = blend(d, ellipsoid(p, {0, .20f, .83f}, {.085f, .075f, .085f}), .03f);      // a knot of hair
  d += .006f * std::sin(60 * (p.z() + .35f * p.y())) * smoothstep(.80f, .86f, p.z() + .25f * p.y());
  return cut(d, -p.z(), .015f);
}

float statue(const Vector3f& p) {
  const Vector3f q(std::fabs(p.x()), p.y(), p.z());
  float d = std::fmax(std::hypot(p.x(), p.y()) - .20f, std::fabs(p.z() - .03f) - .03f);     // plinth
  d = blend(d, capsule(q, {.085f, 0, .06f}, {.055f, .01f, .46f}, .043f, .062f), .03f);      // legs
  d = blend(d, ellipsoid(q, {.085f, -.05f, .075f}, {.038f, .075f, .03f}), .02f);            // feet
  d = blend(d, ellipsoid(p, {0, .01f, .48f}, {.105f, .075f, .075f}), .04f);                 // hips
  d = blend(d, capsule(p, {0, 0, .50f}, {0, -.005f, .70f}, .075f, .085f), .05f);            // trunk
  d = blend(d, ellipsoid(p, {0, 0, .735f}, {.145f, .065f, .05f}), .05f);                    // shoulders
  d = blend(d, capsule(q, {.14f, 0, .74f}, {.265f, .03f, .615f}, .036f, .030f), .03f);      // upper arms
  d = blend(d, capsule(q, {.265f, .03f, .615f}, {.10f, -.02f, .50f}, .030f, .026f), .02f);  // forearms to the hips
  d = blend(d, capsule(p, {0, 0, .76f}, {0, -.005f, .84f}, .038f, .036f), .03f);            // neck
  d = blend(d, ellipsoid(p, {0, -.01f, .905f}, {.068f, .080f, .095f}), .02f);               // head
  d = blend(d, ellipsoid(p, {0, .0f, .965f}, {.10f, .10f, .016f}), .01f);                   // hat
  return cut(d, -p.z(), .01f);
}

float gate(const Vector3f& p) {
  const Vector3f h = Vector3f(.30f, .16f, .5f) - Vector3f::Constant(.05f);
  const Vector3f q = (p - Vector3f(0, 0, .5f)).cwiseAbs() - h;
  float d = q.cwiseMax(0).norm() + std::fmin(q.maxCoeff(), 0.f) - .05f;  // a rounded slab
  const auto bore = [&](const Vector3f& at, const Vector3f& way, float radius) {
    const Vector3f axis = way.normalized(), from = p - at;
    d = cut(d, radius - (from - axis.dot(from) * axis).norm(), .015f);
  };
  bore({0, 0, .30f}, {0, 1, .12f}, .14f);       // wide: many photographs see through it
  bore({-.15f, 0, .68f}, {0, 1, .35f}, .055f);  // narrow: few do
  bore({.15f, 0, .68f}, {.3f, 1, -.25f}, .055f);
  bore({0, 0, .86f}, {1, .05f, .12f}, .045f);  // the long way through: hardly any does
  return cut(d, -p.z(), .01f);
}

}  // namespace

Object from_formula(const char* name, const std::function<float(const Vector3f&)>& formula, const Vector3f& low,
                    const Vector3f& high, double size, int detail, float length,
                    const std::function<int(const Vector3f&)>& material_at) {
  if (detail < 8 || detail > 1000)
    throw Error(ErrorCode::invalid_argument, "detail must be from 8 to 1000 cells", name);
  Polygons polygons = polygonize(formula, low, high, length / float(detail));
  Object object;
  object.name = name;
  object.mesh = std::move(polygons.mesh);
  object.normals = std::move(polygons.normals);
  const auto [a, b] = bounding_box(object.mesh);
  const float unit = (b - a).maxCoeff(), scale = float(size) / unit, foot = a.z();
  for (Vector3f& v : object.mesh.vertices) v = Vector3f(v.x(), v.y(), v.z() - foot) * scale;
  if (material_at)
    object.material_at = [=](const Vector3f& place) { return material_at(place * unit + Vector3f(0, 0, foot)); };
  return object;
}

std::array<Vector3f, 2> bounding_box(const hull::Mesh& mesh) {
  std::array<Vector3f, 2> box{Vector3f::Constant(INFINITY), Vector3f::Constant(-INFINITY)};
  for (const Vector3f& v : mesh.vertices) box = {box[0].cwiseMin(v), box[1].cwiseMax(v)};
  return box;
}

Object make_vase(double size, int detail) {
  Object object = from_formula("vase", vase, {-.42f, -.42f, -.05f}, {.54f, .42f, 1.06f}, size, detail);
  object.material = {
      Pattern::pottery, {{{.62f, .25f, .10f}, {.020f, .035f, .11f}, {.80f, .68f, .45f}}}, .2f, .045f, .30f};
  return object;
}

Object make_bust(double size, int detail) {
  Object object = from_formula("bust", bust, {-.45f, -.38f, -.05f}, {.45f, .40f, 1.06f}, size, detail);
  object.material = {Pattern::marble, {{{.72f, .62f, .50f}, {.30f, .16f, .10f}, {}}}, .1f, .06f, .22f};
  return object;
}

Object make_statue(double size, int detail) {
  Object object = from_formula("statue", statue, {-.36f, -.28f, -.05f}, {.36f, .28f, 1.06f}, size, detail);
  object.material = {Pattern::marble, {{{.055f, .04f, .035f}, {.11f, .075f, .03f}, {}}}, .3f, .10f, .35f};
  return object;
}

Object make_gate(double size, int detail) {
  Object object = from_formula("gate", gate, {-.36f, -.22f, -.05f}, {.36f, .22f, 1.06f}, size, detail);
  object.material = {Pattern::marble, {{{.72f, .68f, .62f}, {.42f, .36f, .30f}, {}}}, .1f, .05f, .25f};
  return object;
}

Object make_box(double size) {
  Object object;
  object.name = "box";
  const float h = float(size) / 2;
  for (int c = 0; c < 8; ++c)
    object.mesh.vertices.emplace_back(c & 1 ? h : -h, c & 2 ? .8f * h : -.8f * h, c & 4 ? 1.2f * h : 0);
  object.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  object.material = {Pattern::checker, {{{.75f, .72f, .65f}, {.45f, .04f, .03f}, {}}}, .15f, .04f, .4f};
  return object;
}

Object make_sphere(double size, int subdivisions) {
  if (subdivisions < 0 || subdivisions > 8)
    throw Error(ErrorCode::invalid_argument, "subdivisions must be from 0 to 8", "sphere");
  Icosphere sphere = icosphere(subdivisions);
  Object object;
  object.name = "sphere";
  object.mesh.triangles = std::move(sphere.triangles);
  const double radius = size / 2;
  for (const Eigen::Vector3d& p : sphere.directions) {
    object.mesh.vertices.push_back((p * radius + Eigen::Vector3d(0, 0, radius)).cast<float>());
    object.normals.push_back(p.cast<float>());
  }
  object.material = {Pattern::stripes, {{{.70f, .20f, .07f}, {.75f, .65f, .40f}, {}}}, .15f, .04f, .2f};
  return object;
}

}  // namespace lumihull::rig
