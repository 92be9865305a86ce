#pragma once

// A ball of triangles, for tests and benchmarks.

#include <lumihull/hull/mesh.h>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace lumihull::test {

/// Sphere of radius 1 around the origin; 4 steps² triangles or so.
inline hull::Mesh sphere(int steps) {
  hull::Mesh mesh;
  const int columns = 2 * steps;
  mesh.vertices.push_back({0, 0, 1});
  for (int i = 1; i < steps; ++i)
    for (int j = 0; j < columns; ++j) {
      const double polar = std::numbers::pi * i / steps, azimuth = 2 * std::numbers::pi * j / columns;
      mesh.vertices.push_back(
          Eigen::Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar))
              .cast<float>());
    }
  mesh.vertices.push_back({0, 0, -1});
  const auto at = [&](int i, int j) { return std::uint32_t(1 + (i - 1) * columns + j % columns); };
  const auto last = std::uint32_t(mesh.vertices.size() - 1);
  for (int j = 0; j < columns; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (int i = 1; i + 1 < steps; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    mesh.triangles.push_back({at(steps - 1, j), last, at(steps - 1, j + 1)});
  }
  return mesh;
}

}  // namespace lumihull::test
