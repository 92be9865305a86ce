#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace lumihull::hull {

/// Triangles over shared vertices, counter-clockwise seen from outside; world units.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  bool empty() const { return triangles.empty(); }
};

/// Throws Error{bad_input} naming the first triangle whose index is out of range or vertex that is not finite.
LUMIHULL_API void validate(const Mesh& mesh, const std::string& name);

/// Area-weighted normal of each vertex, unit length ((0,0,0) where undefined).
LUMIHULL_API std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh);

/// Volume enclosed by a closed mesh (divergence theorem); positive where triangles are oriented outwards.
LUMIHULL_API double enclosed_volume(const Mesh& mesh);

/// Reads PLY (ASCII and binary, both byte orders; polygons become fans) or OBJ by the file's name; positions and faces.
LUMIHULL_API Mesh read_mesh(const std::filesystem::path& file);
/// Writes binary little-endian PLY or OBJ by the file's name, atomically.
LUMIHULL_API void write_mesh(const std::filesystem::path& file, const Mesh& mesh);

}  // namespace lumihull::hull
