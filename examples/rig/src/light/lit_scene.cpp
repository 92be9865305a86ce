#include "lit_scene.h"

#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>

#include "objects/material.h"
#include "objects/shading_mesh.h"

namespace lumihull::rig {

using Eigen::Vector2f;
using Eigen::Vector3f;
using hull::Hit;
using hull::Ray;

Vector3f LightMap::at(float u, float v) const {
  const float x = std::clamp(u, 0.f, 1.f) * float(columns - 1), y = std::clamp(v, 0.f, 1.f) * float(rows - 1);
  const int i = std::min(int(x), columns - 2), j = std::min(int(y), rows - 2);
  const float a = x - float(i), b = y - float(j);
  const Vector3f* p = &values[std::size_t(j) * std::size_t(columns) + std::size_t(i)];
  return (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * p[columns] + a * p[columns + 1]);
}

LitScene::LitScene(const Scene& scene, const LightOptions& options, Job& job)
    : room_(scene.enclosure),
      lamps_(scene.lamps),
      sheets_(scene.sheets),
      center_(scene.center()),
      radius_(scene.radius()) {
  if (options.ambient_rays < 1 || options.ambient_rays > 100'000 || options.lamp_rays < 1 ||
      options.lamp_rays > 100'000 || options.bounces < 1 || options.bounces > 1000 || options.floor_texels < 2 ||
      options.floor_texels > 10'000 || !(options.vertex_spacing > 0))
    throw Error(ErrorCode::invalid_argument, "light options are out of range", "rig");
  offset_ = 1e-4f * (radius_ > 0 ? radius_ : scene.enclosure.radius);
  for (const Object& object : scene.objects) {
    hull::validate(object.mesh, object.name);
    if (!object.mesh.empty()) add(object, options.vertex_spacing);
  }
  if (!mesh_.empty()) rays_.emplace(mesh_);
  look_at_materials();
  light_room(options, job);
  light_objects(options, job);
}

void LitScene::add(const Object& object, float vertex_spacing) {
  const auto [low, high] = bounding_box(object.mesh);
  Part part;
  part.materials = {object.material};
  part.materials.insert(part.materials.end(), object.others.begin(), object.others.end());
  part.material_at = object.material_at;
  part.foot = Vector3f(0, 0, low.z());
  part.size = (high - low).maxCoeff();
  part.textures = object.material_of.empty() ? std::vector<Image>{object.texture} : object.textures;
  part.material_of = object.material_of;
  if (!part.material_of.empty() &&
      (part.material_of.size() != object.mesh.triangles.size() || part.textures.size() != part.materials.size() ||
       *std::max_element(part.material_of.begin(), part.material_of.end()) >= part.materials.size()))
    throw Error(ErrorCode::bad_input, "expected a material for each triangle, and a texture or none for each material",
                object.name);
  const bool textured =
      std::any_of(part.textures.begin(), part.textures.end(), [](const Image& image) { return !image.empty(); });
  if (textured && object.uv.size() != object.mesh.triangles.size())
    throw Error(ErrorCode::bad_input, "a texture needs coordinates for each triangle", object.name);
  ShadingMesh shape = shading_mesh(object, vertex_spacing * part.size);
  part.uv = std::move(shape.uv);
  part.split = std::uint32_t(shape.mesh.triangles.size() / object.mesh.triangles.size());
  part.first_triangle = std::uint32_t(mesh_.triangles.size());
  const auto first_vertex = std::uint32_t(mesh_.vertices.size());
  mesh_.vertices.insert(mesh_.vertices.end(), shape.mesh.vertices.begin(), shape.mesh.vertices.end());
  normals_.insert(normals_.end(), shape.normals.begin(), shape.normals.end());
  for (const auto& [a, b, c] : shape.mesh.triangles)
    mesh_.triangles.push_back({a + first_vertex, b + first_vertex, c + first_vertex});
  object_of_.resize(mesh_.triangles.size(), std::uint32_t(parts_.size()));
  parts_.push_back(std::move(part));
}

void LitScene::hit(std::span<const Ray> rays, std::span<Hit> hits) const {
  if (rays_)
    rays_->hit(rays, hits);
  else
    std::fill(hits.begin(), hits.end(), Hit{});
}

bool LitScene::blocked(const Vector3f& point, const Vector3f& way) const {
  return (rays_ && rays_->occluded({point, way, 0, 1})) || room_.pedestal_between(point, way);
}

Vector3f LitScene::room_radiance(const RoomHit& hit) const {
  if (hit.surface == Room::kCeiling) return room_.enclosure().ceiling;
  return room_.enclosure().glow + room_.paint(hit).cwiseProduct(room_light(hit));
}

Vector3f LitScene::room_light(const RoomHit& hit) const {
  const Enclosure& e = room_.enclosure();
  const Vector3f& p = hit.point;
  const auto square = [&](const LightMap& map, float half) {
    return map.at(.5f + .5f * p.x() / half, .5f + .5f * p.y() / half);
  };
  Vector3f light;
  switch (hit.surface) {
    case Room::kCeiling:
      return Vector3f::Zero();
    case Room::kFloor:
      light = std::max(std::fabs(p.x()), std::fabs(p.y())) < near_floor_
                  ? square(floor_near_, near_floor_)
                  : square(floor_far_, e.radius / std::cos(3.1415927f / float(e.panels)));
      break;
    case Room::kPedestalTop:
      light = square(pedestal_top_, e.pedestal_radius);
      break;
    case Room::kPedestalSide: {
      const float u = std::atan2(p.y(), p.x()) / 6.2831853f;
      light = pedestal_side_.at(u < 0 ? u + 1 : u, p.z() / e.pedestal_height);
      break;
    }
    default: {
      const Vector3f& n = hit.normal;
      const float across = -n.y() * p.x() + n.x() * p.y();
      const float half = e.radius * std::tan(3.1415927f / float(e.panels));
      light = panels_[std::size_t(hit.surface - Room::kPanels)].at(.5f + .5f * across / half, p.z() / e.height);
    }
  }
  return light;
}

Vector3f LitScene::blurred_room(const Vector3f& from, const Vector3f& way, float blur) const {
  const float share = room_.ceiling_share(from, way, blur);
  Vector3f radiance = share * room_.enclosure().ceiling;
  if (share < 1) radiance += (1 - share) * room_radiance(room_.hit_below_ceiling(from, way));
  return radiance;
}

std::size_t LitScene::Part::material_index(const Vector3f& point, std::uint32_t triangle) const {
  if (!material_of.empty()) return material_of[(triangle - first_triangle) / split];
  return material_at ? std::size_t(std::clamp(material_at((point - foot) / size), 0, int(materials.size()) - 1)) : 0;
}

Vector3f LitScene::base_color(const Part& part, std::size_t material, const Hit& hit, const Vector3f& point) const {
  const Image& texture = part.textures[part.material_of.empty() ? 0 : material];
  if (texture.empty()) return pattern_color(part.materials[material], (point - part.foot) / part.size);
  const auto& uv = part.uv[hit.triangle - part.first_triangle];
  const Vector2f at = (1 - hit.b1 - hit.b2) * uv[0] + hit.b1 * uv[1] + hit.b2 * uv[2];
  const Vector2f wrapped = at - at.array().floor().matrix();
  const int w = texture.width(), h = texture.height();
  const float x = wrapped.x() * float(w) - .5f, y = (1 - wrapped.y()) * float(h) - .5f;
  const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
  const float a = x - float(x0), b = y - float(y0);
  const auto texel = [&](int i, int j) {
    const std::uint8_t* p = texture.row<std::uint8_t>((j % h + h) % h) + 3 * ((i % w + w) % w);
    return Vector3f(linear_from_srgb(float(p[0]) / 255), linear_from_srgb(float(p[1]) / 255),
                    linear_from_srgb(float(p[2]) / 255));
  };
  const Vector3f color = (1 - b) * ((1 - a) * texel(x0, y0) + a * texel(x0 + 1, y0)) +
                         b * ((1 - a) * texel(x0, y0 + 1) + a * texel(x0 + 1, y0 + 1));
  return part.material_of.empty() ? color : Vector3f(color.cwiseProduct(part.materials[material].colors[0]));
}

Vector3f LitScene::object_radiance(const Ray& ray, const Hit& hit, Shown shown) const {
  const auto& [ia, ib, ic] = mesh_.triangles[hit.triangle];
  const float b0 = 1 - hit.b1 - hit.b2;
  const Vector3f point = b0 * mesh_.vertices[ia] + hit.b1 * mesh_.vertices[ib] + hit.b2 * mesh_.vertices[ic];
  Vector3f normal = (b0 * normals_[ia] + hit.b1 * normals_[ib] + hit.b2 * normals_[ic]).normalized();
  const Vector3f light = b0 * light_[ia] + hit.b1 * light_[ib] + hit.b2 * light_[ic];
  const Vector3f view = -ray.direction.normalized();
  // An interpolated normal may turn away at the outline; there it is bent back towards the camera.
  float cos_v = normal.dot(view);
  if (cos_v < .02f) {
    normal = (normal + (.02f - cos_v) * view).normalized();
    cos_v = normal.dot(view);
  }
  const Part& part = parts_[object_of_[hit.triangle]];
  const std::size_t material = part.material_index(point, hit.triangle);
  const Material& m = part.materials[material];
  const bool alone = shown == Shown::highlights_alone;
  if (m.unlit) return alone ? Vector3f(Vector3f::Zero()) : m.colors[0];
  const float mirrored = alone ? 0 : mirror(m, cos_v);
  Vector3f radiance = Vector3f::Zero();
  if (!alone) radiance = (1 - mirrored) * base_color(part, material, hit, point).cwiseProduct(light);
  const Vector3f start = point + offset_ * normal;
  for (const Lamp& lamp : lamps_) {
    if (shown == Shown::without_highlights) break;
    const Vector3f way = lamp.position - point;
    const float distance = way.norm();
    const Vector3f shine =
        lamp.intensity * (gloss(m, normal, way / distance, view, lamp.radius / distance) / (distance * distance));
    if (shine.maxCoeff() > 5e-4f && !blocked(start, lamp.position - start)) radiance += shine;
  }
  if (mirrored > 2e-3f) {
    const Vector3f away = 2 * cos_v * normal - view;
    const Ray mirror_ray{start, away};
    if (const Hit other = rays_->hit(mirror_ray))
      radiance += mirrored * touch(mirror_ray, other).radiance;
    else if (room_.contains(start))
      radiance += mirrored * (m.soft_mirror ? blurred_room(start, away, 2 * m.roughness * m.roughness)
                                            : room_radiance(room_.hit(start, away)));
  }
  return radiance;
}

}  // namespace lumihull::rig
