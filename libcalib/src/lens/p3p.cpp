#include "lens/p3p.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d adjugate(const Matrix3d& m) {
  Matrix3d a;
  a.col(0) = m.row(1).cross(m.row(2)).transpose();
  a.col(1) = m.row(2).cross(m.row(0)).transpose();
  a.col(2) = m.row(0).cross(m.row(1)).transpose();
  return a;
}

/// A real root of x³ + b x² + c x + d: of three, the outer one that stands alone.
double cubic_root(double b, double c, double d) {
  const double p = c - b * b / 3, q = b * (2 * b * b / 27 - c / 3) + d;  // of the depressed cubic
  const double discriminant = q * q / 4 + p * p * p / 27;
  double x;
  if (discriminant >= 0 || !(p < 0)) {
    const double root = std::sqrt(std::max(0.0, discriminant));
    const double u = std::cbrt(q > 0 ? -q / 2 - root : -q / 2 + root);
    x = u == 0 ? 0 : u - p / (3 * u);
  } else {
    const double m = 2 * std::sqrt(-p / 3);
    const double angle = std::acos(std::clamp(3 * q / (p * m), -1.0, 1.0)) / 3;
    x = q < 0 ? m * std::cos(angle) : m * std::cos(angle + 2 * std::numbers::pi / 3);
  }
  x -= b / 3;
  for (int i = 0; i < 3; ++i) {
    const double slope = (3 * x + 2 * b) * x + c;
    const double step = (((x + b) * x + c) * x + d) / slope;
    if (!std::isfinite(step)) break;
    x -= step;
  }
  return x;
}

/// Right-handed orthonormal axes of a triangle, columns.
Matrix3d frame(const std::array<Vector3d, 3>& p) {
  Matrix3d m;
  m.col(0) = (p[1] - p[0]).normalized();
  m.col(2) = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  m.col(1) = m.col(2).cross(m.col(0));
  return m;
}

}  // namespace

int p3p(const std::array<Vector3d, 3>& rays, const std::array<Vector3d, 3>& world, std::array<Matrix3d, 4>& rotations,
        std::array<Vector3d, 4>& translations) {
  const std::array<Vector3d, 3> y{rays[0].normalized(), rays[1].normalized(), rays[2].normalized()};
  const double c01 = y[0].dot(y[1]), c02 = y[0].dot(y[2]), c12 = y[1].dot(y[2]);
  double a01 = (world[0] - world[1]).squaredNorm(), a02 = (world[0] - world[2]).squaredNorm(),
         a12 = (world[1] - world[2]).squaredNorm();
  const double size = a01 + a02 + a12;
  const double twice_area2 = (world[1] - world[0]).cross(world[2] - world[0]).squaredNorm();
  if (!(twice_area2 > 1e-10 * size * size)) return 0;  // on a line
  a01 /= size, a02 /= size, a12 /= size;

  Matrix3d m01, m02, m12;
  m01 << 1, -c01, 0, -c01, 1, 0, 0, 0, 0;
  m02 << 1, 0, -c02, 0, 0, 0, -c02, 0, 1;
  m12 << 0, 0, 0, 0, 1, -c12, 0, -c12, 1;
  Matrix3d d1 = a12 * m01 - a01 * m12, d2 = a12 * m02 - a02 * m12;  // ΛᵀD Λ = 0
  double c3 = d2.determinant(), c0 = d1.determinant();
  if (std::abs(c3) < std::abs(c0)) std::swap(d1, d2), std::swap(c3, c0);
  const double b = (adjugate(d2) * d1).trace() / c3, c = (adjugate(d1) * d2).trace() / c3;
  const double gamma = c3 == 0 ? 0 : cubic_root(b, c, c0 / c3);
  if (!std::isfinite(gamma)) return 0;

  // d1 + gamma d2 = a pair of planes: one eigenvalue zero, the other two of different sign.
  Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
  eigen.computeDirect(d1 + gamma * d2);
  const double low = eigen.eigenvalues()[0], high = eigen.eigenvalues()[2];
  if (!(low <= 0 && high >= 0)) return 0;
  int found = 0;
  for (const double sign : {-1.0, 1.0}) {
    const Vector3d plane =
        std::sqrt(high) * eigen.eigenvectors().col(2) + sign * std::sqrt(-low) * eigen.eigenvectors().col(0);
    if (!(plane.norm() > 0)) continue;
    const Vector3d u = plane.unitOrthogonal(), v = plane.normalized().cross(u);
    // Λ = cos u + sin v on the cone d2.
    const double uu = u.dot(d2 * u), uv = u.dot(d2 * v), vv = v.dot(d2 * v);
    const double root = uv * uv - uu * vv;
    if (!(root >= 0)) continue;
    // uu s² + 2 uv s t + vv t² = 0, both lines without cancellation
    const double w = -(uv + (uv >= 0 ? 1 : -1) * std::sqrt(root));
    for (int line = 0; line < 2 && found < 4; ++line) {
      Vector3d depth = line ? Vector3d(vv * u + w * v) : Vector3d(w * u + uu * v);
      if (depth.sum() < 0) depth = -depth;
      if (!(depth.minCoeff() > 0)) continue;
      depth *= std::sqrt(1 / depth.dot((m01 + m02 + m12) * depth));
      for (int i = 0; i < 3; ++i) {  // Newton on the three distances
        const Vector3d f(depth.dot(m01 * depth) - a01, depth.dot(m02 * depth) - a02, depth.dot(m12 * depth) - a12);
        Matrix3d j;
        j << (m01 * depth).transpose(), (m02 * depth).transpose(), (m12 * depth).transpose();
        const Vector3d step = 0.5 * (j.inverse() * f);
        if (!(step.norm() < 0.1 * depth.norm())) break;
        depth -= step;
        if (step.norm() < 1e-13 * depth.norm()) break;
      }
      if (!(depth.minCoeff() > 0)) continue;
      depth *= std::sqrt(size);
      const std::array<Vector3d, 3> camera{depth[0] * y[0], depth[1] * y[1], depth[2] * y[2]};
      const auto at = std::size_t(found);
      rotations[at] = frame(camera) * frame(world).transpose();
      translations[at] =
          (camera[0] + camera[1] + camera[2]) / 3 - rotations[at] * ((world[0] + world[1] + world[2]) / 3);
      if (rotations[at].allFinite() && translations[at].allFinite()) ++found;
    }
  }
  return found;
}

}  // namespace lumihull::calib
