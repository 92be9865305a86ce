// What share of a blurred pixel lies within a contour that is mildly curved.
#include "curved_edge.h"

#include <Eigen/LU>

namespace lumihull::calib {

void CurvedEdge::set(const Eigen::Vector2d& center, const Eigen::Matrix2d& root, double s, double ratio, bool inner) {
  const Eigen::Matrix2d m = ratio * root, inverse = m.inverse();
  cx_ = float(center.x()), cy_ = float(center.y());
  m11_ = float(m(0, 0)), m12_ = float(m(0, 1)), m22_ = float(m(1, 1));
  i11_ = float(inverse(0, 0)), i12_ = float(inverse(0, 1)), i22_ = float(inverse(1, 1));
  det_ = float(m.determinant());
  s_ = float(s), ratio_ = float(ratio);
  inner_ = inner;
  sign_ = inner ? -1.0f : 1.0f;
}

CurvedEdge::Place CurvedEdge::place(const Foot& u) const {
  const Lanes m11 = all(m11_), m12 = all(m12_), m22 = all(m22_);
  Place p{m11 * u.x + m12 * u.y, m12 * u.x + m22 * u.y, m12 * u.x - m11 * u.y, m22 * u.x - m12 * u.y, all(0)};
  p.t2 = p.tx * p.tx + p.ty * p.ty;
  return p;
}

void CurvedEdge::approach(const Lanes& x, const Lanes& y, Foot& u) const {
  const Place p = place(u);
  const Lanes rx = x - p.qx, ry = y - p.qy;
  // d/dt of r · t = 0; a pixel behind the centre of curvature has no nearest point to run to.
  const Lanes bend = p.t2 + rx * p.qx + ry * p.qy, least = all(0.3f) * p.t2;
  Lanes turn = (rx * p.tx + ry * p.ty) / chosen(bend < least, least, bend);
  turn = chosen(turn > all(0.5f), all(0.5f), turn);
  turn = chosen(turn < all(-0.5f), all(-0.5f), turn);
  const Lanes ux = u.x - turn * u.y, uy = u.y + turn * u.x;
  const Lanes length = all(1.5f) - all(0.5f) * (ux * ux + uy * uy);  // Newton's step to length 1
  u.x = ux * length, u.y = uy * length;
}

void CurvedEdge::find(const BlurredEllipse::Pixels& pixels, Foot& foot) const {
  const Lanes x = pixels.x - all(cx_), y = pixels.y - all(cy_);
  const Lanes vx = all(i11_) * x + all(i12_) * y, vy = all(i12_) * x + all(i22_) * y;
  const Lanes scale = inverse_root(vx * vx + vy * vy + all(1e-12f));
  foot.x = vx * scale, foot.y = vy * scale;
  for (int i = 0; i < 3; ++i) approach(x, y, foot);
}

void CurvedEdge::follow(const BlurredEllipse::Pixels& pixels, Foot& foot) const {
  approach(pixels.x - all(cx_), pixels.y - all(cy_), foot);
}

void CurvedEdge::add(const BlurredEllipse::Pixels& pixels, const Foot& foot, BlurredEllipse::Share& share) const {
  const Lanes x = pixels.x - all(cx_), y = pixels.y - all(cy_);
  const Place p = place(foot);
  const Lanes per_t = inverse_root(p.t2), nx = p.ty * per_t, ny = -p.tx * per_t;
  const Lanes per_s = all(1 / s_), distance = ((x - p.qx) * nx + (y - p.qy) * ny) * per_s, square = distance * distance;

  const Lanes per_t2 = per_t * per_t, curvature = all(det_) * per_t * per_t2;
  const Lanes k = curvature * all(s_), kk = k * k;
  const Lanes along = p.tx * p.qx + p.ty * p.qy, q2 = p.qx * p.qx + p.qy * p.qy;
  const Lanes bend =
      all(3 * s_ * s_ * s_) * curvature * per_t2 * per_t2 * (p.t2 - q2 + all(6) * along * along * per_t2);  // q

  const Lanes e = exp_of_negative(all(-0.5f) * square), phi = all(0.39894228f) * e;
  const Lanes third = k * kk * (all(0.0625f) + all(0.3125f) * square);
  const Lanes b = all(0.5f) * k - all(0.375f) * kk * distance + third + all(0.125f) * bend;
  const Lanes b_by_distance = all(-0.375f) * kk + all(0.625f) * k * kk * distance;
  const Lanes b_by_log_k = all(0.5f) * k - all(0.75f) * kk * distance + all(3) * third;
  const Lanes outward = phi * (all(1) - distance * b + b_by_distance);  // by -δ
  const Lanes by_log_k = -phi * b_by_log_k;

  const Lanes sign = all(sign_);
  // The pixel's fourth cumulant.
  const Lanes nn = nx * nx * ny * ny,
              fourth = all(-1 / (2880 * s_ * s_ * s_ * s_)) * (all(1) - all(2) * nn) * (square - all(3)) * distance;
  share.w += sign * (normal_cdf(-distance, e) + phi * (fourth - b));
  const Lanes by_distance = sign * outward * per_s;
  share.by_center[0] += by_distance * nx;
  share.by_center[1] += by_distance * ny;
  // The contour's point moves by ratio · d root · u; its curvature det / |root · u'|³ changes as well.
  const Lanes by_arm = by_distance * all(ratio_), by_bend = sign * by_log_k;
  const Lanes turn = all(-3 * ratio_) * per_t;  // of root without the ratio: |t| / ratio
  const Lanes ax = -ny, ay = nx;                // t / |t|
  share.by_root[0] += by_arm * nx * foot.x + by_bend * (all(ratio_ * i11_) - turn * ax * foot.y);
  share.by_root[1] +=
      by_arm * (nx * foot.y + ny * foot.x) + by_bend * (all(2 * ratio_ * i12_) + turn * (ax * foot.x - ay * foot.y));
  share.by_root[2] += by_arm * ny * foot.y + by_bend * (all(ratio_ * i22_) + turn * ay * foot.x);
  share.by_s += sign * per_s * (outward * distance - phi * (b_by_log_k + all(0.375f) * bend));
  if (inner_) share.by_ratio += (by_distance * all(det_) * per_t - by_bend) * all(1 / ratio_);
}

}  // namespace lumihull::calib
