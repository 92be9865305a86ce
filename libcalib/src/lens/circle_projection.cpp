// The centre of the ellipse that a circle is seen as. Without distortion a closed form; through a lens the
// least-squares ellipse of contour points, and its derivatives; near the circle's edge the closed form again.
#include <lumihull/calib/circle_projection.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace lumihull::calib {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix2x10 = Eigen::Matrix<double, 2, 10>;

/// Places on the contour. A sum over evenly spaced places of a periodic function is exact but for harmonics of this
/// order and above; what the distortion adds to an ellipse has low ones (3rd order in the radius: 4).
constexpr int kPlaces = 16;
using Places = Eigen::Array<double, kPlaces, 1>;

/// Cosine of the angle between line of sight and normal (about the ratio of the ellipse's axes) below which a distorted
/// contour is too thin for an ellipse of its own: it is bent by as much as it is wide, and the closest ellipse jumps.
/// No detector measures these; what is predicted goes over from one kind to the other in between.
constexpr double kThin = 0.12, kWide = 0.2;

struct UnitCircle {
  Places cosine, sine;
};

const UnitCircle& unit_circle() {
  static const UnitCircle places = [] {
    UnitCircle c;
    for (int i = 0; i < kPlaces; ++i) {
      c.cosine[i] = std::cos(2 * std::numbers::pi * i / kPlaces);
      c.sine[i] = std::sin(2 * std::numbers::pi * i / kPlaces);
    }
    return c;
  }();
  return places;
}

/// The contour: points in space, and their pictures with the lens's derivative.
struct Contour {
  Places X, Y, Z;        ///< camera's frame
  Places x, y;           ///< distorted, normalised
  Places jxx, jxy, jyy;  ///< d corrected / d distorted, symmetric
  Places tx, ty;         ///< d (distorted) / d (angle on the circle)
};

/// `Camera::correct` and its Jacobian for all places.
void correct(const Camera& c, const Places& x, const Places& y, Places& cx, Places& cy, Places& jxx, Places& jxy,
             Places& jyy) {
  const Places xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
  const Places radial = r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const Places slope = 2 * (c.k1 + r2 * (2 * c.k2 + r2 * (3 * c.k3)));
  jxx = 1 + radial + xx * slope + 2 * c.p1 * y + 6 * c.p2 * x;
  jyy = 1 + radial + yy * slope + 6 * c.p1 * y + 2 * c.p2 * x;
  jxy = xy * slope + 2 * c.p1 * x + 2 * c.p2 * y;
  cx = x + x * radial + 2 * c.p1 * xy + c.p2 * (r2 + 2 * xx);
  cy = y + y * radial + c.p1 * (r2 + 2 * yy) + 2 * c.p2 * xy;
}

/// Distorted from corrected for all places: Newton steps from the tangent at the centre, whose picture is known. The
/// places are so near that the branch is that of the centre as long as the Jacobian stays well positive on the way.
bool distort(const Camera& c, const Places& cx, const Places& cy, const Vector2d& center,
             const Vector2d& center_distorted, const Matrix2d& lens, Contour& k) {
  const Places ux = cx - center.x(), uy = cy - center.y();
  k.x = center_distorted.x() + lens(0, 0) * ux + lens(0, 1) * uy;
  k.y = center_distorted.y() + lens(1, 0) * ux + lens(1, 1) * uy;
  Places hx, hy;
  for (int i = 0; i < 8; ++i) {
    correct(c, k.x, k.y, hx, hy, k.jxx, k.jxy, k.jyy);
    hx -= cx, hy -= cy;
    const Places determinant = k.jxx * k.jyy - k.jxy * k.jxy;
    if (!(determinant.minCoeff() > 0.02)) break;
    // The last step's square is what is left: no need to evaluate again for it.
    const Places sx = (k.jyy * hx - k.jxy * hy) / determinant, sy = (k.jxx * hy - k.jxy * hx) / determinant;
    k.x -= sx, k.y -= sy;
    if (hx.square().maxCoeff() + hy.square().maxCoeff() < 1e-13) {
      correct(c, k.x, k.y, hx, hy, k.jxx, k.jxy, k.jyy);
      return true;
    }
  }
  // Near a fold: one by one, safely.
  for (int i = 0; i < kPlaces; ++i) {
    Matrix2d inverse;
    const auto d = c.distort({cx[i], cy[i]}, &inverse);
    if (!d) return false;
    const Matrix2d forward = inverse.inverse();
    k.x[i] = d->x(), k.y[i] = d->y(), k.jxx[i] = forward(0, 0), k.jxy[i] = forward(0, 1), k.jyy[i] = forward(1, 1);
  }
  return true;
}

/// The point whose picture is the ellipse's centre where nothing distorts: X - (R²/z) (e₃ - n n_z).
Vector3d center_point(const Circle3& circle, const Vector3d& normal) {
  const double q = circle.radius * circle.radius / circle.center.z();
  return circle.center + q * (normal.z() * normal - Vector3d::UnitZ());
}

/// d (that point) / d (rotation, translation).
Eigen::Matrix<double, 3, 6> center_point_motion(const Circle3& circle, const Vector3d& n) {
  const double z = circle.center.z(), q = circle.radius * circle.radius / z;
  Matrix3d by_center = Matrix3d::Identity();
  by_center.col(2) += (q / z) * (Vector3d::UnitZ() - n.z() * n);
  Matrix3d by_normal = q * n.z() * Matrix3d::Identity();
  by_normal.col(2) += q * n;
  const auto cross = [](const Vector3d& v) {  // w x v = cross(v) w
    Matrix3d m;
    m << 0, v.z(), -v.y(), -v.z(), 0, v.x(), v.y(), -v.x(), 0;
    return m;
  };
  Eigen::Matrix<double, 3, 6> motion;
  motion << by_center * cross(circle.center) + by_normal * cross(n), by_center;
  return motion;
}

/// Least-squares ellipse of contour points in pixels: Gauss-Newton over (centre, symmetric strain), residuals along the
/// normal, weighted by arc length. pull: d centre = Σ pull_i (nᵢ · d pointᵢ).
struct EllipseOfContour {
  Vector2d center;
  Places nx, ny;  ///< unit normals
  Places pull_x, pull_y;
};

bool fit(const Places& px, const Places& py, const Places& weight, const Vector2d& center, const Matrix2d& axes,
         bool derivatives, EllipseOfContour& e) {
  Matrix2d m = axes;
  e.center = center;
  const double size = std::sqrt(std::abs(axes.determinant()));
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Matrix2d w = m.inverse();
    const Places ux = px - e.center.x(), uy = py - e.center.y();
    const Places zx = w(0, 0) * ux + w(0, 1) * uy, zy = w(1, 0) * ux + w(1, 1) * uy;
    // Normal of the ellipse through the point that has the same centre and shape.
    Places gx = w(0, 0) * zx + w(1, 0) * zy, gy = w(0, 1) * zx + w(1, 1) * zy;
    const Places length = (gx * gx + gy * gy).rsqrt();
    e.nx = gx * length, e.ny = gy * length;
    // Distance r along it: |z - r w n|² = 1.
    const Places ax = w(0, 0) * e.nx + w(0, 1) * e.ny, ay = w(1, 0) * e.nx + w(1, 1) * e.ny;
    const Places aa = ax * ax + ay * ay, az = ax * zx + ay * zy, excess = zx * zx + zy * zy - 1;
    const Places r = excess / (az + (az * az - aa * excess).max(0).sqrt());
    const Places fx = (ux - r * e.nx) / size, fy = (uy - r * e.ny) / size;  // foot points
    const Places rows[5] = {e.nx, e.ny, e.nx * fx, e.ny * fy, e.nx * fy + e.ny * fx};
    Eigen::Matrix<double, 5, 5> normal;
    Eigen::Matrix<double, 5, 1> right;
    for (int i = 0; i < 5; ++i) {
      const Places weighted = rows[i] * weight;
      for (int j = 0; j <= i; ++j) normal(i, j) = (weighted * rows[j]).sum();
      right[i] = (weighted * r).sum();
    }
    const Eigen::LLT<Eigen::Matrix<double, 5, 5>> solver(normal);
    if (solver.info() != Eigen::Success) return false;
    const Eigen::Matrix<double, 5, 1> step = solver.solve(right);
    if (!step.allFinite()) return false;
    e.center += step.head<2>();
    Matrix2d strain;
    strain << step[2], step[4], step[4], step[3];
    m += strain / size * m;
    if (step.cwiseAbs().maxCoeff() < 1e-5 * std::sqrt(size) || iteration == 7) {
      if (derivatives) {
        Eigen::Matrix<double, 5, 2> unit = Eigen::Matrix<double, 5, 2>::Zero();
        unit(0, 0) = unit(1, 1) = 1;
        const Eigen::Matrix<double, 5, 2> inverse = solver.solve(unit);
        e.pull_x.setZero(), e.pull_y.setZero();
        for (int i = 0; i < 5; ++i) e.pull_x += inverse(i, 0) * rows[i], e.pull_y += inverse(i, 1) * rows[i];
        e.pull_x *= weight, e.pull_y *= weight;
      }
      return true;
    }
  }
  return false;
}

std::optional<Vector2d> through_lens(const Camera& camera, const Circle3& circle, const Vector3d& center,
                                     Matrix26* jacobian, Matrix2x10* by_parameters) {
  const double inverse_z = 1 / center.z();
  const Vector2d corrected(center.x() * inverse_z, center.y() * inverse_z);
  Matrix2d lens;
  const auto distorted = camera.distort(corrected, &lens);
  if (!distorted) return std::nullopt;

  Contour k;
  const UnitCircle& unit = unit_circle();
  const Places cosine = circle.radius * unit.cosine, sine = circle.radius * unit.sine;
  const Vector3d &o = circle.center, &u = circle.u, &v = circle.v;
  k.X = o.x() + u.x() * cosine + v.x() * sine;
  k.Y = o.y() + u.y() * cosine + v.y() * sine;
  k.Z = o.z() + u.z() * cosine + v.z() * sine;
  const Places iz = k.Z.inverse(), cx = k.X * iz, cy = k.Y * iz;
  if (!distort(camera, cx, cy, corrected, *distorted, lens, k)) return std::nullopt;

  // Tangent of the contour, and from it the arc length of each place.
  const Places dz = v.z() * cosine - u.z() * sine;
  const Places dx = (v.x() * cosine - u.x() * sine - cx * dz) * iz, dy = (v.y() * cosine - u.y() * sine - cy * dz) * iz;
  const Places inverse_det = (k.jxx * k.jyy - k.jxy * k.jxy).inverse();
  k.tx = (k.jyy * dx - k.jxy * dy) * inverse_det, k.ty = (k.jxx * dy - k.jxy * dx) * inverse_det;
  const double fu = camera.s * camera.f, fv = camera.f;
  const Places px = fu * k.x + camera.skew * k.y + camera.u0, py = fv * k.y + camera.v0;
  const Places weight = ((fu * k.tx + camera.skew * k.ty).square() + (fv * k.ty).square()).sqrt() / fv;

  // Start: centre and conjugate axes from the first harmonics.
  const double share = 2.0 / kPlaces;
  Matrix2d axes;
  axes << share * (px * unit.cosine).sum(), share * (px * unit.sine).sum(),  //
      share * (py * unit.cosine).sum(), share * (py * unit.sine).sum();
  EllipseOfContour e;
  if (!(std::abs(axes.determinant()) > 0)) return std::nullopt;
  if (!fit(px, py, weight, camera.pixel_from_distorted(*distorted), axes, jacobian || by_parameters, e))
    return std::nullopt;

  // n · K lens: the normal in corrected coordinates; the Jacobian is symmetric.
  const Places bx = fu * e.nx, by = camera.skew * e.nx + fv * e.ny;
  const Places qx = (k.jyy * bx - k.jxy * by) * inverse_det, qy = (k.jxx * by - k.jxy * bx) * inverse_det;
  if (jacobian) {
    const Places gx = qx * iz, gy = qy * iz, gz = -(gx * cx + gy * cy);
    const Places rx = k.Y * gz - k.Z * gy, ry = k.Z * gx - k.X * gz, rz = k.X * gy - k.Y * gx;
    const Places* const columns[6] = {&rx, &ry, &rz, &gx, &gy, &gz};
    for (int i = 0; i < 6; ++i) {
      (*jacobian)(0, i) = (e.pull_x * *columns[i]).sum();
      (*jacobian)(1, i) = (e.pull_y * *columns[i]).sum();
    }
  }
  if (by_parameters) {
    const Places xx = k.x.square(), yy = k.y.square(), xy = k.x * k.y, r2 = xx + yy;
    const Places along = qx * k.x + qy * k.y;
    const Places columns[10] = {camera.s * e.nx * k.x + e.ny * k.y,
                                camera.f * e.nx * k.x,
                                e.nx * k.y,
                                e.nx,
                                e.ny,
                                -along * r2,
                                -along * r2 * r2,
                                -along * r2 * r2 * r2,
                                -(2 * qx * xy + qy * (r2 + 2 * yy)),
                                -(qx * (r2 + 2 * xx) + 2 * qy * xy)};
    for (int i = 0; i < 10; ++i) {
      (*by_parameters)(0, i) = (e.pull_x * columns[i]).sum();
      (*by_parameters)(1, i) = (e.pull_y * columns[i]).sum();
    }
  }
  return e.center;
}

}  // namespace

std::optional<Vector2d> projected_circle_center(const Camera& camera, const Circle3& circle, Matrix26* jacobian,
                                                Matrix2x10* by_parameters) {
  const Vector3d normal = circle.u.cross(circle.v);
  const double depth = std::sqrt(std::max(0.0, 1 - normal.z() * normal.z()));  // of the circle, per radius
  if (!(circle.center.z() - circle.radius * depth > 0)) return std::nullopt;
  const Vector3d point = center_point(circle, normal);
  // Share of the least-squares ellipse: 3t² - 2t³, so that derivatives have no step either.
  const double distance = circle.center.norm(), facing = normal.dot(circle.center) / distance;
  const bool by_contour = circle.radius > 0 && (by_parameters || camera.has_distortion());
  const double t = by_contour ? std::clamp((std::abs(facing) - kThin) / (kWide - kThin), 0.0, 1.0) : 0;
  if (t >= 1) return through_lens(camera, circle, point, jacobian, by_parameters);

  Matrix23d by_point;
  Vector2d pixel;
  if (by_parameters) {
    if (!camera.project_with_parameter_jacobian(point, &pixel, &by_point, by_parameters)) return std::nullopt;
  } else {
    const auto p = camera.project(point, jacobian ? &by_point : nullptr);
    if (!p) return std::nullopt;
    pixel = *p;
  }
  if (jacobian) *jacobian = by_point * center_point_motion(circle, normal);
  if (t <= 0) return pixel;

  Matrix26 fit_jacobian;
  Matrix2x10 fit_by_parameters;
  const auto fitted = through_lens(camera, circle, point, jacobian ? &fit_jacobian : nullptr,
                                   by_parameters ? &fit_by_parameters : nullptr);
  if (!fitted) return std::nullopt;
  const double share = t * t * (3 - 2 * t);
  const Vector2d apart = *fitted - pixel;
  if (jacobian) {
    *jacobian += share * (fit_jacobian - *jacobian);
    // A rotation about the camera turns normal and line of sight alike; a movement changes the latter.
    const Vector3d by_place = (normal - facing / distance * circle.center) / distance;
    const double by_facing = 6 * t * (1 - t) / (kWide - kThin) * (facing < 0 ? -1 : 1);
    jacobian->rightCols<3>() += by_facing * apart * by_place.transpose();
  }
  if (by_parameters) *by_parameters += share * (fit_by_parameters - *by_parameters);
  return pixel + share * apart;
}

Vector2d homography_circle_center(const Matrix3d& pixel_from_plane, const Vector2d& center, double radius) {
  // C* = H B Hᵀ with B = [c;1][c;1]ᵀ - R² diag(1, 1, 0); its last column is the centre.
  const Vector3d row = pixel_from_plane.row(2);
  const Vector3d c(center.x(), center.y(), 1);
  const Vector3d column = pixel_from_plane * (row.dot(c) * c - radius * radius * Vector3d(row.x(), row.y(), 0));
  if (!(column.z() > 0)) return Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return column.head<2>() / column.z();
}

}  // namespace lumihull::calib
