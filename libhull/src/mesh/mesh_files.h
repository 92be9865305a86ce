#pragma once

// The two mesh formats. Parsers take hostile bytes: nothing is allocated that the file's own length does not pay for.

#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>

#include <cstddef>
#include <string>
#include <string_view>

namespace lumihull::hull {

/// PLY's usual index type is a signed 32-bit integer.
inline constexpr std::size_t kMaxVertices = std::size_t(1) << 31;
inline constexpr std::size_t kMaxMeshFileBytes = std::size_t(8) << 30;

/// Positions and faces; indices are not yet checked (see `validate`). Error{bad_input} naming `name` and the place.
Mesh parse_ply(std::string_view bytes, const std::string& name);
Mesh parse_obj(std::string_view bytes, const std::string& name);

/// Binary little-endian PLY; text OBJ with digits that read back to the same floats.
void write_ply(AtomicFile& out, const Mesh& mesh);
void write_obj(AtomicFile& out, const Mesh& mesh);

}  // namespace lumihull::hull
