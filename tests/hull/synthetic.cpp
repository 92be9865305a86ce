#include "synthetic.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumihull::test {

Shape sphere(const Eigen::Vector3d& center, double radius) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Vector3d to = center - o;
    const double along = to.dot(d);
    return along > 0 && to.squaredNorm() - along * along / d.squaredNorm() < radius * radius;
  };
}

Shape box(const Eigen::Vector3d& center, const Eigen::Vector3d& half) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double near = 0, far = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (center[axis] - half[axis] - o[axis]) / d[axis],
                   b = (center[axis] + half[axis] - o[axis]) / d[axis];
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    return near < far;
  };
}

Shape capsule(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    // Least distance between the ray's line and the segment.
    const Eigen::Vector3d u = b - a, w = a - o;
    const double uu = u.dot(u), ud = u.dot(d), dd = d.dot(d), uw = u.dot(w), dw = d.dot(w);
    const double det = uu * dd - ud * ud;
    const double s = det > 1e-15 ? std::clamp((ud * dw - dd * uw) / det, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d p = a + s * u;
    const double t = (p - o).dot(d) / dd;
    return t > 0 && (o + t * d - p).squaredNorm() < radius * radius;
  };
}

Shape torus(double major, double minor) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& direction) {
    // (|p|² + R² - r²)² - 4 R² (x² + y²) along the ray is a quartic, negative within; s counts from the ray's place m
    // that is nearest to the origin. It is least at a root of its derivative, s³ + a s + b.
    const Eigen::Vector3d d = direction.normalized();
    const double middle = -o.dot(d);
    const Eigen::Vector3d m = o + middle * d;
    const double k = m.squaredNorm() + major * major - minor * minor, four = 4 * major * major;
    const double a = k - four / 2 * d.head<2>().squaredNorm(), b = -four / 2 * m.head<2>().dot(d.head<2>());
    const auto within = [&](double s) {
      const double square = s * s + k;
      return s + middle > 0 && square * square <= four * (m + s * d).head<2>().squaredNorm();
    };
    const double discriminant = b * b / 4 + a * a * a / 27;
    if (discriminant > 0) {  // one root (Cardano), its larger part first
      const double u = std::cbrt(-b / 2 - std::copysign(std::sqrt(discriminant), b));
      return within(u - a / (3 * u));
    }
    const double r = std::sqrt(-a / 3), angle = r > 0 ? std::acos(std::clamp(-b / (2 * r * r * r), -1.0, 1.0)) / 3 : 0;
    constexpr double kThird = 2 * std::numbers::pi / 3;
    return within(2 * r * std::cos(angle)) || within(2 * r * std::cos(angle + kThird)) ||
           within(2 * r * std::cos(angle - kThird));
  };
}

Shape either(std::vector<Shape> shapes) {
  return [shapes = std::move(shapes)](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& s) { return s(o, d); });
  };
}

Image mask_of(const Shape& shape, const View& view) {
  const Camera& camera = view.camera;
  const Eigen::Matrix3d world_from_cam = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d center = view.center();
  const auto hit = [&](double x, double y) {
    const auto ray = camera.ray({x, y});
    return ray && shape(center, world_from_cam * *ray);
  };
  Image mask(camera.width, camera.height, 1);
  std::vector<std::uint8_t> above(std::size_t(camera.width) + 1), below(above);
  for (int x = 0; x <= camera.width; ++x) below[std::size_t(x)] = hit(x, 0);
  for (int y = 0; y < camera.height; ++y) {
    std::swap(above, below);
    for (int x = 0; x <= camera.width; ++x) below[std::size_t(x)] = hit(x, y + 1);
    for (int x = 0; x < camera.width; ++x) {
      const auto i = std::size_t(x);
      const int corners = above[i] + above[i + 1] + below[i] + below[i + 1];
      int sum = corners == 4 ? 256 : 0;
      if (corners > 0 && corners < 4)
        for (int s = 0; s < 256; ++s) sum += hit(x + (s % 16 + 0.5) / 16, y + (s / 16 + 0.5) / 16);
      mask.row<std::uint8_t>(y)[x] = std::uint8_t(std::lround(sum * 255.0 / 256));
    }
  }
  return mask;
}

Camera pinhole(int width, int height, double f) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.f = f;
  camera.u0 = 0.5 * width;
  camera.v0 = 0.5 * height;
  return camera;
}

std::vector<View> views_around(const Camera& camera, int n, double distance, bool hemisphere,
                               const Eigen::Vector3d& target) {
  std::vector<View> views;
  for (int i = 0; i < n; ++i) {
    const double z = hemisphere ? 0.95 - 0.9 * i / n : 1 - 2 * (i + 0.5) / n;
    const double r = std::sqrt(1 - z * z), turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Eigen::Vector3d direction(r * std::cos(turn), r * std::sin(turn), z);
    const Eigen::Vector3d up = std::abs(z) > 0.99 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
    views.push_back({camera, look_at(target + distance * direction, target, up)});
  }
  return views;
}

std::vector<hull::Silhouette> silhouettes_of(const Shape& shape, const std::vector<View>& views,
                                             const hull::SilhouetteOptions& options) {
  std::vector<hull::Silhouette> result;
  for (const View& view : views)
    result.push_back(hull::Silhouette::from_mask(mask_of(shape, view), view.camera, options));
  return result;
}

}  // namespace lumihull::test
