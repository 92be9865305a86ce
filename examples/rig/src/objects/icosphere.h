#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace lumihull::rig {

struct Icosphere {
  std::vector<Eigen::Vector3d> directions;              ///< of unit length
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< seen from outside counter-clockwise
};

/// An icosahedron whose triangles are split in four `subdivisions` times and pushed out: 20 * 4^n triangles. Any value;
/// callers bound it.
Icosphere icosphere(int subdivisions);

}  // namespace lumihull::rig
