#include "view_rays.h"

#include <limits>

namespace lumihull::slf {

ViewRays::ViewRays(const View& view)
    : camera_(view.camera),
      world_from_cam_(view.cam_from_world.rotation.conjugate().toRotationMatrix()),
      everywhere_(true),
      radius2_(0) {
  if (!camera_.has_distortion()) return;
  const double radius = camera_.domain_radius();
  radius2_ = radius * radius;
  // The picture is convex, and so is the disc.
  for (const double u : {0.0, double(camera_.width)})
    for (const double v : {0.0, double(camera_.height)})
      everywhere_ = everywhere_ && camera_.distorted_from_pixel({u, v}).squaredNorm() < radius2_;
}

void ViewRays::fill(std::size_t count, const double* u, const double* v, float* x, float* y, float* z) const {
  const Camera c = camera_;
  const Eigen::Matrix3d r = world_from_cam_;
  const bool bent = c.has_distortion(), whole = everywhere_;
  const double sf = c.s * c.f, radius2 = radius2_;
  // Camera::distorted_from_pixel and Camera::correct, written out: the compiler makes four at a time of it.
  const auto turn = [&](double dx, double dy, std::size_t i) {
    x[i] = float(r(0, 0) * dx + r(0, 1) * dy + r(0, 2));
    y[i] = float(r(1, 0) * dx + r(1, 1) * dy + r(1, 2));
    z[i] = float(r(2, 0) * dx + r(2, 1) * dy + r(2, 2));
  };
  if (!bent) {
    for (std::size_t i = 0; i < count; ++i) {
      const double dy = (v[i] - c.v0) / c.f;
      turn((u[i] - c.u0 - c.skew * dy) / sf, dy, i);
    }
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double dy = (v[i] - c.v0) / c.f, dx = (u[i] - c.u0 - c.skew * dy) / sf;
    const double xx = dx * dx, yy = dy * dy, xy = dx * dy, r2 = xx + yy;
    const double radial = r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    const double nowhere = whole || r2 < radius2 ? 0 : std::numeric_limits<double>::quiet_NaN();
    turn(dx + dx * radial + 2 * c.p1 * xy + c.p2 * (r2 + 2 * xx) + nowhere,
         dy + dy * radial + c.p1 * (r2 + 2 * yy) + 2 * c.p2 * xy + nowhere, i);
  }
}

Eigen::Matrix<float, 3, 2> ViewRays::slopes(const Eigen::Vector2d& pixel) const {
  Eigen::Matrix2d lens, from_pixel;
  camera_.correct(camera_.distorted_from_pixel(pixel), &lens);
  from_pixel << 1 / (camera_.s * camera_.f), -camera_.skew / (camera_.s * camera_.f * camera_.f), 0, 1 / camera_.f;
  const Eigen::Matrix<double, 3, 2> in_world = world_from_cam_.leftCols<2>() * (lens * from_pixel);
  return in_world.cast<float>();
}

Eigen::AlignedBox2d ViewRays::bounds(int x0, int y0, int width, int height) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::AlignedBox2d anywhere{Eigen::Vector2d(-kInfinity, -kInfinity), Eigen::Vector2d(kInfinity, kInfinity)};
  if (!everywhere_) return anywhere;
  Eigen::AlignedBox2d box;
  const auto add = [&](int u, int v) {
    const Eigen::Vector2d d = camera_.distorted_from_pixel(Eigen::Vector2d(u, v));
    box.extend(camera_.has_distortion() ? camera_.correct(d) : d);
  };
  // A lens maps inside to inside: the border says all. Between its points a pixel's width is more than enough.
  const int step_x = camera_.has_distortion() ? 1 : width, step_y = camera_.has_distortion() ? 1 : height;
  for (int x = 0; x <= width; x += step_x) add(x0 + x, y0), add(x0 + x, y0 + height);
  for (int y = 0; y <= height; y += step_y) add(x0, y0 + y), add(x0 + width, y0 + y);
  if (!box.min().allFinite() || !box.max().allFinite()) return anywhere;
  const Eigen::Vector2d pixel = box.sizes().cwiseQuotient(Eigen::Vector2d(width, height));
  return {box.min() - pixel, box.max() + pixel};
}

}  // namespace lumihull::slf
