#pragma once

// What the stages leave in a capture's folder, read. Where a stage has not been run: Error{not_found} that names it.

#include <lumihull/base/capture.h>
#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/light_field_glb.h>

#include <filesystem>
#include <string>
#include <system_error>

namespace lumihull::slf {

/// The file, where it is there.
inline std::filesystem::path result_of(const std::filesystem::path& file, const std::string& stage) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    throw Error(ErrorCode::not_found, "the file is missing; run the stage \"" + stage + "\" first", file.string());
  return file;
}

/// hull.ply
inline hull::Mesh read_hull(const Capture& capture) { return hull::read_mesh(result_of(capture.hull_path(), "hull")); }
/// textured.glb
inline TexturedMesh read_textured(const Capture& capture) {
  return read_glb(result_of(capture.folder() / "textured.glb", "texture"));
}
/// light_field.glb
inline LightField read_light_field(const Capture& capture) {
  return read_light_field(result_of(capture.folder() / "light_field.glb", "lightfield"));
}
/// evaluation.json: one JSON object
inline std::string read_evaluation(const Capture& capture) {
  return read_file(result_of(capture.folder() / "evaluate" / "evaluation.json", "evaluate"));
}

}  // namespace lumihull::slf
