// Fuzz target: files of light fields. What is read can be written and read again, and shown.

#include <lumihull/base/error.h>
#include <lumihull/slf/light_field_glb.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

namespace {

using namespace lumihull;

/// Small enough for hundreds of views a second.
bool small(const slf::LightField& field) {
  return field.base.texture.bytes() < 10'000 && field.base.mesh.triangles.size() < 1000;
}

void write_and_read(const slf::LightField& field) {
  const slf::LightField again =
      slf::decode_light_field(slf::encode_light_field(field, {.texture_quality = 0, .map_quality = 0}), "again");
  if (again.base.mesh.triangles.size() != field.base.mesh.triangles.size() || again.nodes != field.nodes ||
      again.terms.size() != field.terms.size() || again.slot.empty() != field.slot.empty())
    std::abort();
}

/// The corpus' objects are about the origin; adaptive rays pass by it, too.
void show(const slf::LightField& field) {
  const slf::LightFieldRenderer renderer(field);
  Camera camera;
  camera.width = camera.height = 12;
  camera.f = 12;
  camera.u0 = camera.v0 = 6;
  Job job({}, 1);
  for (const bool adaptive : {false, true}) {
    const Pose pose = look_at({3, -4, 1}, {0, 0, 0}, {0, 0, 1});
    renderer.render({camera, pose}, {.rays = 2, .depth = true, .adaptive = adaptive}, job);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::optional<slf::LightField> field;
  try {
    field = slf::decode_light_field(std::string(reinterpret_cast<const char*>(data), size), "fuzz");
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal || e.code() == ErrorCode::out_of_memory) std::abort();
    return 0;
  }
  if (!small(*field)) return 0;
  write_and_read(*field);
  show(*field);
  return 0;
}
