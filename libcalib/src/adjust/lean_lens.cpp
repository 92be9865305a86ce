#include "lean_lens.h"

#include <algorithm>

namespace lumihull::calib::bundle {

LeanLens::LeanLens(const Camera& camera)
    : camera_(camera), distorts_(camera.has_distortion()), fu_(camera.s * camera.f) {
  // Where the Jacobian of F has a norm below 1, d + F(d) keeps distances positive: one-to-one on that disc.
  const auto bound = [&](double r) {
    const double r2 = r * r;
    return 3 * std::abs(camera.k1) * r2 + 5 * std::abs(camera.k2) * r2 * r2 + 7 * std::abs(camera.k3) * r2 * r2 * r2 +
           6 * (std::abs(camera.p1) + std::abs(camera.p2)) * r;
  };
  double low = 0, high = 20;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (bound(middle) < 0.9 ? low : high) = middle;
  }
  safe_r2_ = low * low;
}

bool LeanLens::see(const Eigen::Vector3d& point, const Eigen::Vector2d& near, Seen& seen) const {
  if (!(point.z() > 0)) return false;
  const double inverse_z = 1 / point.z(), cx = point.x() * inverse_z, cy = point.y() * inverse_z;
  const Camera& c = camera_;
  if (!distorts_) {
    seen.x = cx, seen.y = cy, seen.jxx = seen.jyy = 1, seen.jxy = 0;
    seen.pixel = {fu_ * cx + c.skew * cy + c.u0, c.f * cy + c.v0};
    return true;
  }
  double y = (near.y() - c.v0) / c.f, x = (near.x() - c.u0 - c.skew * y) / fu_;
  if (!(x * x + y * y <= safe_r2_)) x = cx, y = cy;
  bool found = false;
  for (int i = 0; i < 8; ++i) {
    const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
    if (!(r2 <= safe_r2_)) break;
    const double radial = r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    const double slope = 2 * (c.k1 + r2 * (2 * c.k2 + r2 * (3 * c.k3)));
    const double fxx = 1 + radial + xx * slope + 2 * c.p1 * y + 6 * c.p2 * x;
    const double fyy = 1 + radial + yy * slope + 6 * c.p1 * y + 2 * c.p2 * x;
    const double fxy = xy * slope + 2 * c.p1 * x + 2 * c.p2 * y;
    const double inverse = 1 / (fxx * fyy - fxy * fxy);
    seen.jxx = fyy * inverse, seen.jxy = -fxy * inverse, seen.jyy = fxx * inverse;
    if (found) break;
    const double hx = x + x * radial + 2 * c.p1 * xy + c.p2 * (r2 + 2 * xx) - cx;
    const double hy = y + y * radial + c.p1 * (r2 + 2 * yy) + 2 * c.p2 * xy - cy;
    const double sx = seen.jxx * hx + seen.jxy * hy, sy = seen.jxy * hx + seen.jyy * hy;
    x -= sx, y -= sy;
    // What is left after a step is of the order of its square.
    found = sx * sx + sy * sy < 1e-14;
  }
  if (!found || !(x * x + y * y <= safe_r2_)) {
    Eigen::Matrix2d lens;
    const auto d = c.distort({cx, cy}, &lens);
    if (!d) return false;
    x = d->x(), y = d->y();
    seen.jxx = lens(0, 0), seen.jxy = lens(0, 1), seen.jyy = lens(1, 1);
  }
  seen.x = x, seen.y = y;
  seen.pixel = {fu_ * x + c.skew * y + c.u0, c.f * y + c.v0};
  return true;
}

void LeanLens::by_point(const Eigen::Vector3d& point, const Seen& s, Eigen::Vector3d& u, Eigen::Vector3d& v) const {
  const double iz = 1 / point.z(), cx = point.x() * iz, cy = point.y() * iz, f = camera_.f;
  const double ux = (fu_ * s.jxx + camera_.skew * s.jxy) * iz, uy = (fu_ * s.jxy + camera_.skew * s.jyy) * iz;
  const double vx = f * s.jxy * iz, vy = f * s.jyy * iz;
  u = {ux, uy, -ux * cx - uy * cy};
  v = {vx, vy, -vx * cx - vy * cy};
}

void LeanLens::by_parameters(const Seen& s, double* u, double* v) const {
  const double x = s.x, y = s.y, r2 = x * x + y * y, f = camera_.f;
  u[0] = camera_.s * x, u[1] = f * x, u[2] = y, u[3] = 1, u[4] = 0;
  v[0] = y, v[1] = v[2] = v[3] = 0, v[4] = 1;
  // d + F(d, k) = c with c fixed: dd/dk = -(I + dF/dd)⁻¹ dF/dk.
  const double ux = fu_ * s.jxx + camera_.skew * s.jxy, uy = fu_ * s.jxy + camera_.skew * s.jyy;
  const double vx = f * s.jxy, vy = f * s.jyy;
  const double along_u = -(ux * x + uy * y) * r2, along_v = -(vx * x + vy * y) * r2;
  u[5] = along_u, u[6] = along_u * r2, u[7] = u[6] * r2;
  v[5] = along_v, v[6] = along_v * r2, v[7] = v[6] * r2;
  const double xy = 2 * x * y, py = r2 + 2 * y * y, px = r2 + 2 * x * x;
  u[8] = -(ux * xy + uy * py), u[9] = -(ux * px + uy * xy);
  v[8] = -(vx * xy + vy * py), v[9] = -(vx * px + vy * xy);
}

}  // namespace lumihull::calib::bundle
