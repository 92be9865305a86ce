#pragma once

#include <lumihull/base/api.h>
#include <lumihull/slf/textured_mesh.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace lumihull::slf {

struct GlbOptions {
  int jpeg_quality = 92;  ///< 1 … 100; 0: PNG, without loss
  bool normals = false;   ///< smooth normals for viewers that light the model themselves
};

/// A textured mesh as glTF 2.0 binary (Khronos Group 2021, chapter 4): one mesh, one primitive, positions, texture
/// coordinates, 16- or 32-bit indices, the picture as JPEG or PNG, and an unlit material (KHR_materials_unlit, in
/// extensionsUsed only). Vertices are doubled where they have several places in the texture. World coordinates are
/// stored as they are: a viewer that expects y up and metres shows them turned. Errors: bad_input (mesh), unsupported
/// (more than 4 GB), invalid_argument (options), degenerate (no triangles).
LUMIHULL_API std::string encode_glb(const TexturedMesh& textured, const GlbOptions& options = {});

/// The same into a file, atomically. Returns its size in bytes.
LUMIHULL_API std::uint64_t write_glb(const std::filesystem::path& file, const TexturedMesh& textured,
                                     const GlbOptions& options = {});

/// Reads a file of the layout that `write_glb` writes (any glTF 2.0 binary whose first primitive has float positions
/// and texture coordinates, 8-, 16- or 32-bit indices in triangles, tightly packed or strided, and an embedded base
/// colour texture). Errors: not_found, io, bad_input (what is wrong and where), unsupported (valid, but other than
/// that).
LUMIHULL_API TexturedMesh read_glb(const std::filesystem::path& file);

}  // namespace lumihull::slf
