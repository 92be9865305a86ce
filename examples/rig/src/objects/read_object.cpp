#include <lumihull/base/error.h>
#include <lumihull/base/files.h>
#include <lumihull/rig/object.h>

#include <cmath>

#include "obj_uv.h"
#include "read_glb.h"

namespace lumihull::rig {

namespace fs = std::filesystem;

Object read_object(const fs::path& file, const fs::path& texture, double size, bool y_up) {
  if (!(size > 0) || !std::isfinite(size))
    throw Error(ErrorCode::invalid_argument, "the object's size must be positive", file.string());
  const bool glb = file.extension() == ".glb";
  Object object;
  if (glb)
    object = read_glb(file);
  else
    object.mesh = hull::read_mesh(file);
  object.name = file.stem().string();
  if (object.mesh.empty()) throw Error(ErrorCode::bad_input, "the mesh has no triangle", file.string());
  if (!texture.empty()) {
    object.uv = obj_texture_coordinates(read_file(file), file.string());
    if (object.uv.size() != object.mesh.triangles.size())
      throw Error(ErrorCode::bad_input, "expected texture coordinates for each face", file.string());
    object.texture = converted(read_image(texture), PixelType::u8, 3);
  }
  if (y_up)
    for (Eigen::Vector3f& v : object.mesh.vertices) v = Eigen::Vector3f(v.x(), -v.z(), v.y());
  const auto [low, high] = bounding_box(object.mesh);
  const float extent = (high - low).maxCoeff();
  if (!(extent > 0) || !std::isfinite(extent) || !std::isfinite(float(size) / extent))
    throw Error(ErrorCode::bad_input, "the mesh has no extent, or one that is not finite", file.string());
  const Eigen::Vector3f foot((low.x() + high.x()) / 2, (low.y() + high.y()) / 2, low.z());
  for (Eigen::Vector3f& v : object.mesh.vertices) v = (v - foot) * (float(size) / extent);
  if (glb) return object;
  object.material.colors[0] = {.55f, .48f, .40f};
  object.material.colors[1] = {.25f, .12f, .08f};
  object.material.pattern = Pattern::marble;
  object.material.roughness = .35f;
  return object;
}

Object object_by_name(const std::string& name, double size) {
  if (!(size > 0) || !std::isfinite(size))
    throw Error(ErrorCode::invalid_argument, "the object's size must be positive", name);
  if (name == "vase") return make_vase(size);
  if (name == "bust") return make_bust(size);
  if (name == "statue") return make_statue(size);
  if (name == "snowmobile") return make_snowmobile(size);
  if (name == "deer") return make_deer(size);
  if (name == "gate") return make_gate(size);
  if (name == "box") return make_box(size);
  if (name == "sphere") return make_sphere(size);
  if (name == "pebble") return make_pebble(size);
  const fs::path file = name;
  const std::string extension = file.extension().string();
  if (extension != ".obj" && extension != ".ply" && extension != ".glb")
    throw Error(
        ErrorCode::invalid_argument,
        "expected vase, bust, statue, snowmobile, deer, gate, box, sphere, pebble, or a mesh file (.obj, .ply, .glb)",
        name);
  const bool obj = extension == ".obj";
  fs::path texture = file;
  texture.replace_extension(".png");
  return read_object(file, obj && fs::exists(texture) ? texture : fs::path(), size, extension != ".ply");
}

}  // namespace lumihull::rig
