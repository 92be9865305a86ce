// A pebble: an ellipsoid of three different axes with a hump on its shoulder, convex, smooth, glossy.

#include <lumihull/base/error.h>
#include <lumihull/rig/object.h>

#include <cmath>

#include "icosphere.h"

namespace lumihull::rig {

using Eigen::Vector3d;

namespace {

const Vector3d kHalfAxes(.5, .40, .33);
const Vector3d kMiddle(0, 0, .33);
// The hump's ball does not reach the ends of the long axis, nor the foot: those are the ellipsoid's.
const Vector3d kHump(.12, -.20, .52);
constexpr double kReach = .38, kHeight = .16;

}  // namespace

// F(p) = |A⁻¹ (p - m)|² - 1 - h (1 - r² / R²)³, r the distance from the hump's middle, the last term only within R. The
// second derivative of -h (1 - r² / R²)³ is at least -4.8 h / R² in any direction (radially, where r² = 0.6 R²), that
// of the first term at least 2 / 0.5² = 8: with h = .16, R = .38 F is convex, hence the body.
double pebble_function(const Vector3d& p, Vector3d* gradient) {
  const Vector3d q = (p - kMiddle).cwiseQuotient(kHalfAxes), from_hump = p - kHump;
  double f = q.squaredNorm() - 1;
  if (gradient) *gradient = 2 * q.cwiseQuotient(kHalfAxes);
  const double rest = 1 - from_hump.squaredNorm() / (kReach * kReach);
  if (rest > 0) {
    f -= kHeight * rest * rest * rest;
    if (gradient) *gradient += 6 * kHeight / (kReach * kReach) * rest * rest * from_hump;
  }
  return f;
}

Object make_pebble(double size, int subdivisions) {
  if (subdivisions < 1 || subdivisions > 8)
    throw Error(ErrorCode::invalid_argument, "subdivisions must be from 1 to 8", "pebble");
  Object object;
  object.name = "pebble";
  Icosphere sphere = icosphere(subdivisions);
  object.mesh.triangles = std::move(sphere.triangles);
  object.mesh.vertices.reserve(sphere.directions.size());
  object.normals.reserve(sphere.directions.size());
  for (const Vector3d& d : sphere.directions) {
    // Along the ray from the middle F is convex and begins below zero: Newton's steps from outside come down to its
    // only zero, never past it.
    const Vector3d way = d.cwiseProduct(kHalfAxes);
    double t = 1.3;
    Vector3d gradient;
    for (int i = 0; i < 50; ++i) {
      const double step = pebble_function(kMiddle + t * way, &gradient) / gradient.dot(way);
      t -= step;
      if (std::fabs(step) < 1e-15) break;
    }
    const Vector3d p = kMiddle + t * way;
    pebble_function(p, &gradient);
    object.mesh.vertices.push_back((size * p).cast<float>());
    object.normals.push_back(gradient.normalized().cast<float>());
  }
  // Little green: the underside, which the room alone lights, must not look like a green room.
  object.material = {
      Pattern::patches, {{{.36f, .15f, .22f}, {.15f, .08f, .20f}, {.48f, .27f, .33f}}}, 0, .05f, .30f, true};
  object.stand = float(.13 * size);
  return object;
}

}  // namespace lumihull::rig
