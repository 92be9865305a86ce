#include "icosphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lumihull::rig {

Icosphere icosphere(int subdivisions) {
  Icosphere sphere;
  auto& points = sphere.directions;
  auto& triangles = sphere.triangles;
  const double g = (1 + std::sqrt(5.0)) / 2;
  for (int axis = 0; axis < 3; ++axis)
    for (int s = 0; s < 4; ++s) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      p[axis] = s & 1 ? 1 : -1;
      p[(axis + 1) % 3] = s & 2 ? g : -g;
      points.push_back(p.normalized());
    }
  const double edge = 2 / std::hypot(1, g);
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = a + 1; b < 12; ++b)
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        const auto near = [&](std::uint32_t i, std::uint32_t j) {
          return (points[i] - points[j]).norm() < edge * 1.01;
        };
        if (!near(a, b) || !near(b, c) || !near(a, c)) continue;
        const bool outwards = (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0;
        triangles.push_back(outwards ? std::array{a, b, c} : std::array{a, c, b});
      }
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle_of;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, added] = middle_of.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
      if (added) points.push_back((points[a] + points[b]).normalized());
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    finer.reserve(triangles.size() * 4);
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  return sphere;
}

}  // namespace lumihull::rig
