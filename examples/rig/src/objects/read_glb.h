#pragma once

#include <lumihull/rig/object.h>

#include <filesystem>

namespace lumihull::rig {

/// The triangles of a binary glTF 2.0 file's scene, in its own frame (y up, metres), vertices of one place merged; base
/// colours and their textures, metallic and roughness factors. Other textures, skins and animations are not read; a
/// metal's mirror has no colour. Errors: bad_input naming the file, the place in its JSON, and what was expected.
Object read_glb(const std::filesystem::path& file);

}  // namespace lumihull::rig
