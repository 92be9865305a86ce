#pragma once

#include <lumihull/rig/flat_print.h>

namespace lumihull::rig {

inline FlatShape disc(const Eigen::Vector2d& center, double radius, const Eigen::Vector3f& color) {
  FlatShape s;
  s.color = color, s.center = center, s.radius = radius;
  return s;
}

inline FlatShape rectangle(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Eigen::Vector3f& color) {
  FlatShape s;
  s.color = color;
  s.polygon = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  return s;
}

}  // namespace lumihull::rig
