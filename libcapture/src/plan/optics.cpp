// Lens, sensor and object: distances, depth of field, framing.
#include <lumihull/base/error.h>
#include <lumihull/capture/optics.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "expect.h"

namespace lumihull::capture {
namespace {

using internal::expect_between;

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string said(const char* format, double a, double b = 0, double c = 0) {
  char text[256];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

/// At the polar angle phi in the meridian of azimuth 0, turned by `error` towards the zenith.
Pose meridian_pose(double radius, double phi, double error, Orientation orientation) {
  const Vector3d out(std::sin(phi), 0, std::cos(phi)), up(-std::cos(phi), 0, std::sin(phi));
  const Vector3d axis = -std::cos(error) * out + std::sin(error) * up;
  const Vector3d eye = radius * out;
  const Vector3d top = std::cos(error) * up + std::sin(error) * out;
  // Portrait: the picture's rows run up the meridian.
  return look_at(eye, eye + axis, orientation == Orientation::landscape ? top : Vector3d(0, 1, 0));
}

}  // namespace

void check(const Optics& o) {
  expect_between(o.focal_length_mm, 0.1, 10000, "focal length, mm");
  expect_between(o.sensor_width_mm, 0.1, 1000, "sensor width, mm");
  expect_between(o.sensor_height_mm, 0.1, 1000, "sensor height, mm");
  expect_between(o.width_px, 1, 65500, "picture width, px");
  expect_between(o.height_px, 1, 65500, "picture height, px");
  expect_between(o.f_number, 0.3, 1000, "f-number");
  expect_between(o.circle_of_confusion_mm, 1e-5, 10, "circle of confusion, mm");
}

double ObjectSize::bounding_radius_m() const {
  return height_m > 0 ? 0.5 * std::hypot(diameter_m, height_m) : 0.5 * diameter_m;
}

void check(const ObjectSize& object) {
  expect_between(object.diameter_m, 1e-4, 1000, "object diameter, m");
  if (object.height_m != 0) expect_between(object.height_m, 1e-4, 1000, "object height, m");
}

double image_distance_mm(const Optics& optics, double focus_m) {
  check(optics);
  const double f = optics.focal_length_mm, d = 1000 * focus_m;
  if (!(d > f)) throw Error(ErrorCode::invalid_argument, "the distance must be larger than the focal length", "focus");
  return std::isfinite(d) ? f * d / (d - f) : f;
}

Camera ideal_camera(const Optics& optics, double focus_m) {
  const double v = image_distance_mm(optics, focus_m);
  Camera camera;
  camera.width = optics.width_px, camera.height = optics.height_px;
  camera.f = v * optics.height_px / optics.sensor_height_mm;
  camera.s = (optics.width_px / optics.sensor_width_mm) / (optics.height_px / optics.sensor_height_mm);
  camera.u0 = 0.5 * optics.width_px, camera.v0 = 0.5 * optics.height_px;
  return camera;
}

std::vector<Vector3d> object_outline(const ObjectSize& object, const Vector3d& center, const Vector3d& eye,
                                     int samples) {
  check(object);
  std::vector<Vector3d> points;
  const double around = 1 / std::cos(kPi / samples);
  const Vector3d to_eye = eye - center;
  if (object.height_m > 0) {
    const double r = 0.5 * object.diameter_m, h = 0.5 * object.height_m;
    if (std::hypot(to_eye.x(), to_eye.y()) <= r && std::abs(to_eye.z()) <= h) return points;
    for (int i = 0; i < samples; ++i) {
      const double a = 2 * kPi * i / samples;
      for (const double z : {-h, h})
        points.push_back(center + Vector3d(around * r * std::cos(a), around * r * std::sin(a), z));
    }
    return points;
  }
  const double r = 0.5 * object.diameter_m, d = to_eye.norm();
  if (d <= r) return points;
  // The circle where rays from the eye touch the sphere.
  const Vector3d axis = to_eye / d, any = std::abs(axis.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
  const Vector3d u = axis.cross(any).normalized(), v = axis.cross(u);
  const Vector3d middle = center + axis * (r * r / d);
  const double ring = around * r * std::sqrt(1 - r * r / (d * d));
  for (int i = 0; i < samples; ++i) {
    const double a = 2 * kPi * i / samples;
    points.push_back(middle + ring * (std::cos(a) * u + std::sin(a) * v));
  }
  return points;
}

Framing framing(const View& view, const ObjectSize& object, const Vector3d& center) {
  Framing found;
  const std::vector<Vector3d> outline = object_outline(object, center, view.center());
  found.least_margin_px = outline.empty() ? -kInfinity : kInfinity;
  Vector2d low(kInfinity, kInfinity), high = -low;
  for (const Vector3d& point : outline) {
    const auto px = view.project(point);
    if (!px) {
      found.least_margin_px = -kInfinity;
      return found;
    }
    low = low.cwiseMin(*px), high = high.cwiseMax(*px);
    found.least_margin_px =
        std::min({found.least_margin_px, px->x(), px->y(), view.camera.width - px->x(), view.camera.height - px->y()});
  }
  if (outline.empty()) return found;
  found.whole = found.least_margin_px >= 0;
  found.fill = std::max((high.x() - low.x()) / view.camera.width, (high.y() - low.y()) / view.camera.height);
  return found;
}

double fill_radius(const Optics& optics, const ObjectSize& object, Orientation orientation, double margin,
                   double pointing_error_rad) {
  check(optics);
  check(object);
  expect_between(margin, 0, 0.45, "margin");
  expect_between(pointing_error_rad, 0, kPi / 3, "pointing error, rad");
  const double least = std::max(object.bounding_radius_m() * (1 + 1e-9), 2e-3 * optics.focal_length_mm);
  const auto fits = [&](double radius) {
    Camera camera = ideal_camera(optics, radius);
    // A narrower picture in place of a margin: what stays free is a share of the picture.
    camera.u0 -= margin * camera.width, camera.v0 -= margin * camera.height;
    const double width = (1 - 2 * margin) * camera.width, height = (1 - 2 * margin) * camera.height;
    constexpr int kSteps = 18;
    for (int i = 0; i <= kSteps; ++i)
      for (const double error : {-pointing_error_rad, pointing_error_rad}) {
        const View view{camera, meridian_pose(radius, 0.5 * kPi * i / kSteps, error, orientation)};
        const auto outline = object_outline(object, Vector3d::Zero(), view.center(), 180);
        if (outline.empty()) return false;
        for (const Vector3d& point : outline) {
          const auto px = view.project(point);
          if (!px || px->x() < 0 || px->y() < 0 || px->x() > width || px->y() > height) return false;
        }
        if (object.height_m == 0 && pointing_error_rad == 0) return true;  // alike from everywhere
      }
    return true;
  };
  double low = least, high = 1000;
  if (!fits(high))
    throw Error(ErrorCode::degenerate, "no distance up to 1 km shows the whole object: less margin, or a wider lens",
                "radius");
  if (fits(low)) return low;
  for (int i = 0; i < 80 && high - low > 1e-9 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? high : low) = middle;
  }
  return high;
}

Sharpness sharpness(const Optics& optics, double distance_m, double exposure_s, double blur_px) {
  expect_between(exposure_s, 1e-6, 3600, "exposure, s");
  expect_between(blur_px, 1e-3, 1000, "blur, px");
  const Camera camera = ideal_camera(optics, distance_m);
  const double f = 1e-3 * optics.focal_length_mm, d = distance_m;
  Sharpness s;
  s.hyperfocal_m = f * f / (optics.f_number * 1e-3 * optics.circle_of_confusion_mm) + f;
  s.near_m = d * (s.hyperfocal_m - f) / (s.hyperfocal_m + d - 2 * f);
  s.far_m = d < s.hyperfocal_m ? d * (s.hyperfocal_m - f) / (s.hyperfocal_m - d) : kInfinity;
  s.pixels_per_mm = camera.f / (1000 * d);
  s.field_horizontal_rad = 2 * std::atan(0.5 * camera.width / (camera.s * camera.f));
  s.field_vertical_rad = 2 * std::atan(0.5 * camera.height / camera.f);
  s.largest_turn_rad_s = blur_px / (camera.f * exposure_s);
  s.largest_speed_m_s = s.largest_turn_rad_s * d;
  return s;
}

double step_for_overlap(double overlap, double object_radius_m, double distance_m, double usable_rad) {
  expect_between(overlap, 0, 0.99, "overlap");
  expect_between(usable_rad, 1e-3, 0.5 * kPi, "usable angle, rad");
  expect_between(object_radius_m, 0, 1000, "object radius, m");
  if (!(distance_m > object_radius_m) || !std::isfinite(distance_m))
    throw Error(ErrorCode::invalid_argument, "the camera must be outside of the object", "distance, m");
  return (1 - overlap) * 2 * std::min(usable_rad, std::acos(object_radius_m / distance_m));
}

std::vector<std::string> optics_warnings(const Optics& optics, const ObjectSize& object, double distance_m,
                                         double exposure_s) {
  check(object);
  const double r = object.bounding_radius_m();
  std::vector<std::string> warnings;
  if (distance_m <= r) {
    warnings.push_back(
        said("the camera at %.2f m is inside of the sphere of %.2f m that holds the object", distance_m, r));
    return warnings;
  }
  const Sharpness s = sharpness(optics, distance_m, exposure_s);
  if (s.near_m > distance_m - r || s.far_m < distance_m + r)
    warnings.push_back(said("the depth of field, %.2f to %.2f m, is smaller than the object", s.near_m, s.far_m) +
                       said(", %.2f to %.2f m: a larger f-number, or a shorter lens", distance_m - r, distance_m + r));
  // The pixel is the finest that is recorded; diffraction beyond two of them costs what the small aperture gains.
  const double airy_mm = 2.44 * 550e-6 * optics.f_number, pixel_mm = optics.sensor_height_mm / optics.height_px;
  if (airy_mm > 4 * pixel_mm)
    warnings.push_back(said("f/%g blurs by diffraction over %.1f pixels", optics.f_number, airy_mm / pixel_mm));
  return warnings;
}

}  // namespace lumihull::capture
