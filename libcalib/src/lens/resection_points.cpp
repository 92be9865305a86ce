#include "lens/resection_points.h"

#include <lumihull/base/error.h>
#include <lumihull/calib/circle_projection.h>
#include <lumihull/internal/small_matrices.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void check(bool good, const char* message) {
  if (!good) throw Error(ErrorCode::invalid_argument, message, "resect");
}

/// Whether there are four places apart from each other by more than rounding.
bool four_places(std::span<const PointMatch> matches, double tolerance) {
  std::array<Vector3d, 4> places;
  std::size_t found = 0;
  for (const PointMatch& m : matches) {
    bool fresh = true;
    for (std::size_t k = 0; k < found; ++k) fresh = fresh && (m.world - places[k]).norm() > tolerance;
    if (fresh) places[found++] = m.world;
    if (found == 4) return true;
  }
  return false;
}

Matrix2d pixel_matrix(const Camera& c) {
  Matrix2d k;
  k << c.s * c.f, c.skew, 0, c.f;
  return k;
}

}  // namespace

ResectionPoints::ResectionPoints(const Camera& cam, std::span<const PointMatch> matches)
    : camera(cam), count(matches.size()) {
  check(count >= 4, "expected at least 4 matches");
  check(count <= 100'000'000, "expected at most 1e8 matches");
  Vector2d pixel_mean = Vector2d::Zero();
  double largest = 0;  // radius of distorted points
  Vector2d farthest = Vector2d::Zero();
  for (const PointMatch& m : matches) {
    check(m.pixel.allFinite() && m.world.allFinite(), "pixels and world points must be finite");
    origin += m.world / double(count);
    pixel_mean += m.pixel / double(count);
    const double radius = camera.distorted_from_pixel(m.pixel).squaredNorm();
    if (radius >= largest) largest = radius, farthest = m.pixel;
  }
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const PointMatch& m : matches) {
    moments += (m.world - origin) * (m.world - origin).transpose() / double(count);
    spread_px += (m.pixel - pixel_mean).squaredNorm() / double(count);
  }
  spread_px = std::sqrt(spread_px);
  unit = std::sqrt(moments.trace());
  check(std::isfinite(unit) && std::isfinite(spread_px) && std::isfinite(largest),
        "pixels and world points are too large");
  const double rounding = 1e-13 * (origin.norm() + unit);
  if (!four_places(matches, std::max(10 * rounding, 1e-9 * unit)))
    throw Error(ErrorCode::degenerate, "expected at least 4 different world points: repeated ones don't count",
                "resect");
  const internal::SymmetricAxes principal = internal::symmetric_axes(moments / (unit * unit));
  extent = principal.values.reverse().cwiseMax(0).cwiseSqrt();
  axes << principal.vectors.col(2), principal.vectors.col(1), principal.vectors.col(2).cross(principal.vectors.col(1));
  if (!(extent[1] > std::max(1e-6, 10 * rounding / unit)))
    throw Error(ErrorCode::degenerate, "all world points lie on one line: the rotation about it is unknown", "resect");

  // A lens is one-to-one on a disc: where the farthest pixel has a ray, all have.
  const double domain = camera.ray(farthest) ? kInfinity : camera.domain_radius();
  const bool lensed = camera.has_distortion();
  blocks.resize((count + kLanes - 1) / kLanes);
  if (lensed) lens.resize(blocks.size());
  seen.assign(blocks.size() * kLanes, 0);
  const Matrix2d k = pixel_matrix(camera);
  for (std::size_t i = 0; i < blocks.size() * kLanes; ++i) {
    Block& b = blocks[i / kLanes];
    const auto lane = Eigen::Index(i % kLanes);
    if (lane == 0) {
      b = {Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(),
           Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(),
           Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
      if (lensed)
        lens[i / kLanes] = {Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
    }
    if (i >= count) continue;
    const PointMatch& m = matches[i];
    const double xx = m.covariance(0, 0), xy = 0.5 * (m.covariance(0, 1) + m.covariance(1, 0)), yy = m.covariance(1, 1);
    const double determinant = xx * yy - xy * xy;
    check(std::isfinite(xx + xy + yy) && xx > 0 && determinant > 1e-12 * xx * yy,
          "covariances must be finite and positive definite");
    check(std::isfinite(m.radius) && m.radius >= 0, "radii must be finite and not negative");
    const double c00 = std::sqrt(xx), c10 = xy / c00, c11 = std::sqrt(determinant) / c00;
    Matrix2d whiten;
    whiten << 1 / c00, 0, -c10 / (c00 * c11), 1 / c11;
    const Vector2d d = camera.distorted_from_pixel(m.pixel);
    const bool has_ray = d.norm() < domain;
    Matrix2d forward = Matrix2d::Identity();
    const Vector2d c = lensed ? camera.correct(d, &forward) : d;
    const Vector3d p = (m.world - origin) / unit;
    b.x[lane] = p.x(), b.y[lane] = p.y(), b.z[lane] = p.z();
    b.cx[lane] = c.x(), b.cy[lane] = c.y();
    const Matrix2d v = whiten * k;
    if (has_ray) {
      seen[i] = 1;
      const Matrix2d w = v * forward.inverse();
      b.w00[lane] = w(0, 0), b.w01[lane] = w(0, 1), b.w10[lane] = w(1, 0), b.w11[lane] = w(1, 1);
    }
    if (lensed) {
      LensBlock& l = lens[i / kLanes];
      l.dx[lane] = d.x(), l.dy[lane] = d.y();
      l.v00[lane] = v(0, 0), l.v01[lane] = v(0, 1), l.v10[lane] = v(1, 0), l.v11[lane] = v(1, 1);
    }
    if (m.radius > 0) {
      const double length = m.normal.norm();
      check(std::isfinite(length) && length > 0, "a circle's normal must be finite and not zero");
      const Vector3d n = m.normal / length;
      b.r2[lane] = m.radius * m.radius / (unit * unit);
      b.nx[lane] = n.x(), b.ny[lane] = n.y(), b.nz[lane] = n.z();
      circles = true;
    }
  }
}

Pose ResectionPoints::pose(const LocalPose& p) const {
  Pose result;
  result.rotation = Eigen::Quaterniond(p.rotation).normalized();
  result.translation = unit * p.center - result.rotation * origin;
  return result;
}

void ResectionPoints::renew_lens_terms(const LocalPose& pose) {
  const Camera& c = camera;
  for (std::size_t at = 0; at < lens.size(); ++at) {
    Block& b = blocks[at];
    const LensBlock& l = lens[at];
    b.ex.setZero(), b.ey.setZero();
    const BlockResidual o = circles ? BlockResidual::at<true>(b, pose) : BlockResidual::at<false>(b, pose);
    // Distorted from corrected by Newton's method, from the measured point: near it where the match is right.
    Lanes x = l.dx, y = l.dy, hx, hy, determinant;
    for (int i = 0; i < 4; ++i) {
      const Lanes xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
      const Lanes radial = r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
      const Lanes slope = 2 * (c.k1 + r2 * (2 * c.k2 + r2 * (3 * c.k3)));
      const Lanes jxx = 1 + radial + xx * slope + 2 * c.p1 * y + 6 * c.p2 * x;
      const Lanes jyy = 1 + radial + yy * slope + 6 * c.p1 * y + 2 * c.p2 * x;
      const Lanes jxy = xy * slope + 2 * c.p1 * x + 2 * c.p2 * y;
      hx = x + x * radial + 2 * c.p1 * xy + c.p2 * (r2 + 2 * xx) - o.cx;
      hy = y + y * radial + c.p1 * (r2 + 2 * yy) + 2 * c.p2 * xy - o.cy;
      determinant = jxx * jyy - jxy * jxy;
      x -= (jyy * hx - jxy * hy) / determinant, y -= (jxx * hy - jxy * hx) / determinant;
      if ((hx.abs() + hy.abs()).maxCoeff() < 1e-8) break;  // its square is what is left
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = at * kLanes + std::size_t(lane);
      if (i >= count || seen[i] == 0 || !(o.front[lane] > 0)) continue;
      Vector2d distorted(x[lane], y[lane]);
      if (b.r2[lane] > 0) {
        const Vector3d n(o.nx[lane], o.ny[lane], o.nz[lane]);
        Circle3 circle;
        circle.center = Vector3d(o.px[lane], o.py[lane], o.pz[lane]) + pose.center;
        circle.u = n.unitOrthogonal(), circle.v = n.cross(circle.u), circle.radius = std::sqrt(b.r2[lane]);
        const auto pixel = projected_circle_center(c, circle);
        if (!pixel) continue;
        distorted = c.distorted_from_pixel(*pixel);
      } else if (!(determinant[lane] > 0.05 && std::abs(hx[lane]) + std::abs(hy[lane]) < 1e-6)) {
        const auto d = c.distort({o.cx[lane], o.cy[lane]});
        if (!d) continue;
        distorted = *d;
      }
      const double ux = distorted.x() - l.dx[lane], uy = distorted.y() - l.dy[lane];
      b.ex[lane] = l.v00[lane] * ux + l.v01[lane] * uy - o.rx[lane];
      b.ey[lane] = l.v10[lane] * ux + l.v11[lane] * uy - o.ry[lane];
    }
  }
}

void squared_distances(const ResectionPoints& points, const LocalPose& pose, std::vector<double>& d2) {
  d2.resize(points.blocks.size() * kLanes);
  for (std::size_t at = 0; at < points.blocks.size(); ++at) {
    const auto& b = points.blocks[at];
    const BlockResidual o = points.circles ? BlockResidual::at<true>(b, pose) : BlockResidual::at<false>(b, pose);
    const Lanes d = (o.front > 0).select(o.rx * o.rx + o.ry * o.ry, kInfinity);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = at * kLanes + std::size_t(lane);
      d2[i] = points.seen[i] > 0 && d[lane] <= 1e300 ? d[lane] : kInfinity;
    }
  }
  d2.resize(points.count);
}

Score truncated_score(const ResectionPoints& points, const LocalPose& pose, double limit, double enough) {
  const double most = limit * limit;
  Lanes cost = Lanes::Zero(), inliers = Lanes::Zero();
  for (std::size_t at = 0; at < points.blocks.size(); ++at) {
    const auto& b = points.blocks[at];
    const BlockResidual o = points.circles ? BlockResidual::at<true>(b, pose) : BlockResidual::at<false>(b, pose);
    const Lanes d = o.rx * o.rx + o.ry * o.ry;
    const Lanes seen = Eigen::Map<const Lanes>(&points.seen[at * kLanes]);
    const auto good = o.front > 0 && d < most;
    cost += seen * good.select(d, most);
    inliers += seen * good.select(Lanes::Ones(), Lanes::Zero());
    if (at % 16 == 15 && cost.sum() > enough) break;
  }
  return {cost.sum(), int(inliers.sum())};
}

}  // namespace lumihull::calib
