#include "shutter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lumihull::rig {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Shutter::Shutter(const View& view, const PhotoOptions& options, std::span<const Pose> during, double center_depth)
    : view_(view), moments_(during.begin(), during.end()) {
  if (moments_.empty()) moments_ = {view.cam_from_world};
  focus_m_ = options.focus_m > 0 ? options.focus_m : std::max(center_depth, 1e-3);
  if (options.f_number > 0) {
    // Camera::f is the distance from lens to sensor; the focal length follows from where it is sharp (1 / F = 1 / s +
    // 1 / s').
    const double image_m = 1e-3 * view.camera.f * options.sensor_width_mm / view.camera.width;
    radius_m_ = .5 / (1 / image_m + 1 / focus_m_) / options.f_number;
  }
}

double Shutter::confusion_px(double depth) const {
  return view_.camera.f * 2 * radius_m_ * std::fabs(1 / depth - 1 / focus_m_);
}

double Shutter::motion_px(double depth) const {
  double most = 0;
  if (moments_.size() < 2) return most;
  for (int i = 0; i < 9; ++i) {
    const auto ray = view_.camera.ray({view_.camera.width * (i % 3) / 2., view_.camera.height * (i / 3) / 2.});
    if (!ray) continue;
    const Vector3d world = view_.cam_from_world.inverse() * (depth * *ray);
    Eigen::AlignedBox2d box;
    for (const Pose& pose : moments_)
      if (const auto px = view_.camera.project(pose * world)) box.extend(*px);
    if (!box.isEmpty()) most = std::max(most, box.diagonal().norm());
  }
  return most;
}

Moment Shutter::at(double time) const {
  const double t = std::clamp(time, 0., 1.) * double(moments_.size() - 1);
  const std::size_t i = std::min(std::size_t(t), moments_.size() - 1), j = std::min(i + 1, moments_.size() - 1);
  const double b = t - double(i);
  const Pose &from = moments_[i], &to = moments_[j];
  if (i == j || b == 0) return {from.rotation.conjugate().toRotationMatrix(), from.center()};
  // Between two moments the angle is small: the normalised mean of quaternions is as even as a slerp.
  const double sign = from.rotation.dot(to.rotation) < 0 ? -1 : 1;
  Eigen::Quaterniond q;
  q.coeffs() = (1 - b) * from.rotation.coeffs() + sign * b * to.rotation.coeffs();
  return {q.normalized().conjugate().toRotationMatrix(), (1 - b) * from.center() + b * to.center()};
}

hull::Ray Shutter::ray(const Vector3d& direction, const Vector2d& lens, double time) const {
  const Moment moment = at(time);
  const Vector3d from(radius_m_ * lens.x(), radius_m_ * lens.y(), 0);
  // All rays of a place in the picture meet at focus_m · direction.
  return {(moment.center + moment.world_from_cam * from).cast<float>(),
          (moment.world_from_cam * (direction - from / focus_m_)).cast<float>()};
}

PixelSamples::PixelSamples(int side) : side_(side) {
  lens_.resize(std::size_t(side) * std::size_t(side));
  std::iota(lens_.begin(), lens_.end(), 0);
  time_ = lens_;
}

void PixelSamples::shuffle(std::uint64_t hash) {
  hash_ = hash;
  std::uint64_t random = hash;
  for (std::vector<int>* parts : {&lens_, &time_}) {
    std::iota(parts->begin(), parts->end(), 0);  // the order is this pixel's alone
    for (std::size_t i = parts->size() - 1; i > 0; --i) {
      random = mix(random);
      std::swap((*parts)[i], (*parts)[std::size_t((random >> 32) * (i + 1) >> 32)]);
    }
  }
}

Vector2d PixelSamples::lens(int ray) const {
  const int cell = lens_[std::size_t(ray)];
  const std::uint64_t random = mix(hash_, 8 + 2 * std::uint64_t(ray));
  const double x = 2 * (cell % side_ + unit_double(random)) / side_ - 1;
  const double y = 2 * (cell / side_ + unit_double(mix(random))) / side_ - 1;
  if (x == 0 && y == 0) return {0, 0};
  constexpr double kQuarter = .78539816339744831;
  const bool wide = std::fabs(x) > std::fabs(y);
  const double r = wide ? x : y, phi = wide ? kQuarter * y / x : kQuarter * (2 - x / y);
  return {r * std::cos(phi), r * std::sin(phi)};
}

double PixelSamples::time(int ray) const {
  return (time_[std::size_t(ray)] + unit_double(mix(hash_, 9 + 2 * std::uint64_t(ray)))) / double(time_.size());
}

}  // namespace lumihull::rig
