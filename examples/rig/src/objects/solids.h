#pragma once

// Signed distances (nearly) of simple bodies, and how they are joined; negative inside.

#include <lumihull/rig/object.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "polygonize.h"

namespace lumihull::rig {

/// Smooth minimum: a union with a fillet of about k (Quilez, polynomial form).
inline float blend(float a, float b, float k) {
  const float h = std::fmax(k - std::fabs(a - b), 0.f) / k;
  return std::fmin(a, b) - h * h * k * 0.25f;
}
inline float cut(float a, float b, float k) { return -blend(-a, -b, k); }  // smooth maximum: an intersection

inline float ellipsoid(const Eigen::Vector3f& p, const Eigen::Vector3f& c, const Eigen::Vector3f& r) {
  const Eigen::Vector3f q = p - c;
  const float k0 = q.cwiseQuotient(r).norm(), k1 = q.cwiseQuotient(r.cwiseProduct(r)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -r.minCoeff();
}

inline float capsule(const Eigen::Vector3f& p, const Eigen::Vector3f& a, const Eigen::Vector3f& b, float ra, float rb) {
  const Eigen::Vector3f ab = b - a;
  const float t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.f, 1.f);
  return (p - a - t * ab).norm() - (ra + t * (rb - ra));
}

/// A box with rounded edges, half sides h (before rounding) around c.
inline float rounded_box(const Eigen::Vector3f& p, const Eigen::Vector3f& c, const Eigen::Vector3f& h, float round) {
  const Eigen::Vector3f q = (p - c).cwiseAbs() - h + Eigen::Vector3f::Constant(round);
  return q.cwiseMax(0).norm() + std::fmin(q.maxCoeff(), 0.f) - round;
}

/// The object whose surface is formula = 0 within a box, `size` metres along its longest side, standing on z = 0;
/// `detail` cells make `length` in the formula's unit. material_at: which material a place in the formula's frame has,
/// if several.
Object from_formula(const char* name, const std::function<float(const Eigen::Vector3f&)>& formula,
                    const Eigen::Vector3f& low, const Eigen::Vector3f& high, double size, int detail, float length = 1,
                    const std::function<int(const Eigen::Vector3f&)>& material_at = {});

}  // namespace lumihull::rig
