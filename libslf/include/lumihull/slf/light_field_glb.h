#pragma once

#include <lumihull/base/api.h>
#include <lumihull/slf/light_field.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace lumihull::slf {

struct LightFieldFileOptions {
  int texture_quality = 92;  ///< of the mean colour's JPEG, as the mean texture's, 1 … 100; 0: PNG, without loss
  int map_quality = 75;      ///< of the surface maps' JPEGs, likewise
};

/// A light field as glTF 2.0 binary. Any viewer shows the mesh with its texture (see encode_glb); whoever knows the
/// extension LUMIHULL_surface_light_field on the primitive (in extensionsUsed only) shows the light field.
/// libslf/README.md says what is in the extension. Vertices that no triangle uses are left out. Errors: bad_input
/// (field), invalid_argument (options), unsupported (a file or unpacked maps of more than 4 GB), degenerate (no
/// triangles).
LUMIHULL_API std::string encode_light_field(const LightField& field, const LightFieldFileOptions& options = {});

/// The same into a file, atomically. Returns its size in bytes.
LUMIHULL_API std::uint64_t write_light_field(const std::filesystem::path& file, const LightField& field,
                                             const LightFieldFileOptions& options = {});

/// Reads what `write_light_field` writes. Every count, size and index is checked. Errors: not_found, io, bad_input
/// (what is wrong and where; a model without light field), unsupported (another version).
LUMIHULL_API LightField read_light_field(const std::filesystem::path& file);

/// The same from bytes in memory; `name` is used in errors.
LUMIHULL_API LightField decode_light_field(std::string bytes, const std::string& name);

/// Whether a model's file has a light field, of whatever version. Errors: not_found, io, bad_input (no glTF binary),
/// unsupported.
LUMIHULL_API bool has_light_field(const std::filesystem::path& file);

}  // namespace lumihull::slf
