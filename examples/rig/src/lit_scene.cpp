#include "lit_scene.h"

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>

#include "material.h"
#include "noise.h"
#include "shading_mesh.h"

namespace lumihull::rig {

using Eigen::Vector2f;
using Eigen::Vector3f;
using hull::Hit;
using hull::Ray;

namespace {

/// Point i of n of Hammersley's set in [0, 1)², shifted by `turn` (Cranley & Patterson 1976).
Vector2f spread_point(int i, int n, std::uint64_t turn) {
  std::uint32_t bits = std::uint32_t(i);
  float radical = 0, weight = .5f;
  for (; bits; bits >>= 1, weight *= .5f) radical += weight * float(bits & 1);
  Vector2f p((float(i) + .5f) / float(n), radical);
  p += Vector2f(unit_float(turn), unit_float(mix(turn)));
  return p - p.array().floor().matrix();
}

/// Direction around +z with density cos / pi.
Vector3f cosine_direction(const Vector2f& p) {
  const float r = std::sqrt(p.x()), phi = 6.2831853f * p.y();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.f, 1 - p.x()))};
}

}  // namespace

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
      ambient_(scene.ambient),
      center_(scene.center()),
      radius_(scene.radius()) {
  if (options.ambient_rays < 1 || options.ambient_rays > 100'000 || options.lamp_rays < 1 ||
      options.lamp_rays > 100'000 || options.floor_texels < 2 || options.floor_texels > 10'000 ||
      !(options.vertex_spacing > 0))
    throw Error(ErrorCode::invalid_argument, "light options are out of range", "rig");
  offset_ = 1e-4f * (radius_ > 0 ? radius_ : scene.enclosure.radius);
  for (const Object& object : scene.objects) {
    hull::validate(object.mesh, object.name);
    if (!object.mesh.empty()) add(object, options.vertex_spacing);
  }
  if (!mesh_.empty()) rays_.emplace(mesh_);
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
  part.texture = object.texture;
  if (!object.texture.empty() && object.uv.size() != object.mesh.triangles.size())
    throw Error(ErrorCode::bad_input, "a texture needs coordinates for each triangle", object.name);
  ShadingMesh shape = shading_mesh(object, vertex_spacing * part.size);
  part.uv = std::move(shape.uv);
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

Vector3f LitScene::lamps_at(const Vector3f& point, const Vector3f& normal, int rays, std::uint64_t turn) const {
  const Vector3f start = point + offset_ * normal;
  Vector3f sum = Vector3f::Zero();
  for (std::size_t k = 0; k < lamps_.size(); ++k) {
    const Lamp& lamp = lamps_[k];
    const Vector3f to_lamp = lamp.position - point;
    if (normal.dot(to_lamp) <= -lamp.radius) continue;
    const Eigen::Matrix3f frame = frame_around(to_lamp.normalized());
    float visible = 0;
    for (int i = 0; i < rays; ++i) {
      // Uniform over the disc that the lamp shows.
      const Vector2f p = spread_point(i, rays, mix(turn, k));
      const float r = lamp.radius * std::sqrt(p.x()), phi = 6.2831853f * p.y();
      const Vector3f way = lamp.position + r * (std::cos(phi) * frame.col(0) + std::sin(phi) * frame.col(1)) - start;
      const float cosine = normal.dot(way) / way.norm();
      if (cosine > 0 && !blocked(start, way)) visible += cosine / way.squaredNorm();
    }
    sum += lamp.intensity * (visible / float(rays));
  }
  return sum;
}

void LitScene::light_room(const LightOptions& options, Job& job) {
  const Enclosure& e = room_.enclosure();
  struct Node {
    RoomHit at;
    Vector3f* light;
  };
  std::vector<Node> nodes;
  const auto prepare = [&](LightMap& map, int columns, int rows, int surface, auto&& place) {
    map.columns = std::max(2, columns), map.rows = std::max(2, rows);
    map.values.resize(std::size_t(map.columns) * std::size_t(map.rows));
    for (int j = 0; j < map.rows; ++j)
      for (int i = 0; i < map.columns; ++i) {
        const auto [point, normal] = place(float(i) / float(map.columns - 1), float(j) / float(map.rows - 1));
        nodes.push_back(
            {{surface, 0, point, normal}, &map.values[std::size_t(j) * std::size_t(map.columns) + std::size_t(i)]});
      }
  };
  const int n = options.floor_texels;
  const float around = e.radius / std::cos(3.1415927f / float(e.panels));
  near_floor_ = std::min(around, std::max(4 * radius_, 2 * e.pedestal_radius));
  const auto square = [](float half, float z) {
    return [=](float u, float v) {
      return std::pair<Vector3f, Vector3f>({half * (2 * u - 1), half * (2 * v - 1), z}, Vector3f::UnitZ());
    };
  };
  prepare(floor_far_, n / 2, n / 2, Room::kFloor, square(around, 0));
  if (near_floor_ > 0) prepare(floor_near_, n, n, Room::kFloor, square(near_floor_, 0));
  if (e.pedestal_height > 0) {
    prepare(pedestal_top_, n, n, Room::kPedestalTop, square(e.pedestal_radius, e.pedestal_height));
    prepare(pedestal_side_, n, n / 3, Room::kPedestalSide, [&](float u, float v) {
      const Vector3f normal(std::cos(6.2831853f * u), std::sin(6.2831853f * u), 0);
      return std::pair<Vector3f, Vector3f>(e.pedestal_radius * normal + Vector3f(0, 0, v * e.pedestal_height), normal);
    });
  }
  panels_.resize(std::size_t(e.panels));
  const float half = e.radius * std::tan(3.1415927f / float(e.panels));
  for (int i = 0; i < e.panels; ++i)
    prepare(panels_[std::size_t(i)], n / 5, n / 5, Room::kPanels + i, [&, i](float u, float v) {
      const Vector3f normal = room_.panel_normal(i), along(-normal.y(), normal.x(), 0);
      return std::pair<Vector3f, Vector3f>(
          -e.radius * normal + half * (2 * u - 1) * along + Vector3f(0, 0, v * e.height), normal);
    });

  job.begin("light of the room", nodes.size());
  parallel_chunks(
      job, nodes.size(), 256,
      [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
          const RoomHit& at = nodes[i].at;
          // One set of rays for all nodes: errors then vary smoothly, not as grain.
          Vector3f light = lamps_at(at.point, at.normal, options.lamp_rays, 1);
          int open = options.ambient_rays;
          if (rays_ && (at.point - center_).norm() < 8 * radius_) {
            const Eigen::Matrix3f frame = frame_around(at.normal);
            for (int k = 0; k < options.ambient_rays; ++k) {
              const Vector3f way = frame * cosine_direction(spread_point(k, options.ambient_rays, 2));
              open -= rays_->occluded({at.point + offset_ * at.normal, way});
            }
          }
          light += ambient_ * room_.edge_shade(at) * (float(open) / float(options.ambient_rays));
          *nodes[i].light = light;
        }
      },
      true);
  job.end();
}

void LitScene::light_objects(const LightOptions& options, Job& job) {
  light_.assign(mesh_.vertices.size(), Vector3f::Zero());
  job.begin("light on the objects", light_.size());
  parallel_chunks(
      job, light_.size(), 256,
      [&](std::size_t first, std::size_t last) {
        std::vector<Ray> rays(static_cast<std::size_t>(options.ambient_rays));
        std::vector<std::uint8_t> hidden(rays.size());
        for (std::size_t i = first; i < last; ++i) {
          const Vector3f& point = mesh_.vertices[i];
          const Vector3f& normal = normals_[i];
          const std::uint64_t turn = mix(i);
          const Eigen::Matrix3f frame = frame_around(normal);
          for (int k = 0; k < options.ambient_rays; ++k)
            rays[std::size_t(k)] = {point + offset_ * normal,
                                    frame * cosine_direction(spread_point(k, options.ambient_rays, turn))};
          rays_->occluded(rays, hidden);
          Vector3f around = Vector3f::Zero();
          for (std::size_t k = 0; k < rays.size(); ++k) {
            if (hidden[k]) {
              around += .25f * ambient_;  // some light bounces inside folds
            } else if (room_.contains(rays[k].origin)) {
              around += room_radiance(room_.hit(rays[k].origin, rays[k].direction));
            }
          }
          light_[i] = lamps_at(point, normal, options.lamp_rays, turn) + around / float(rays.size());
        }
      },
      true);
  job.end();

  // The rays' noise is spread over neighbours: two rounds, each vertex and the mean of its ring in equal parts.
  for (int round = 0; round < 2; ++round) {
    std::vector<Vector3f> sum(light_.size(), Vector3f::Zero());
    std::vector<float> count(light_.size(), 0.f);
    for (const auto& t : mesh_.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[std::size_t(k)], b = t[std::size_t(k + 1) % 3];
        sum[a] += light_[b], sum[b] += light_[a];
        count[a] += 1, count[b] += 1;
      }
    for (std::size_t i = 0; i < light_.size(); ++i)
      if (count[i] > 0) light_[i] = .5f * light_[i] + .5f * sum[i] / count[i];
  }
}

Vector3f LitScene::room_radiance(const RoomHit& hit) const {
  if (hit.surface == Room::kCeiling) return room_.enclosure().ceiling;
  return room_.paint(hit).cwiseProduct(room_light(hit));
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

const Material& LitScene::Part::at(const Vector3f& point) const {
  if (!material_at) return materials[0];
  return materials[std::size_t(std::clamp(material_at((point - foot) / size), 0, int(materials.size()) - 1))];
}

Vector3f LitScene::base_color(const Part& part, const Material& material, const Hit& hit, const Vector3f& point) const {
  if (part.texture.empty()) return pattern_color(material, (point - part.foot) / part.size);
  const auto& uv = part.uv[hit.triangle - part.first_triangle];
  const Vector2f at = (1 - hit.b1 - hit.b2) * uv[0] + hit.b1 * uv[1] + hit.b2 * uv[2];
  const Vector2f wrapped = at - at.array().floor().matrix();
  const int w = part.texture.width(), h = part.texture.height();
  const float x = wrapped.x() * float(w) - .5f, y = (1 - wrapped.y()) * float(h) - .5f;
  const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
  const float a = x - float(x0), b = y - float(y0);
  const auto texel = [&](int i, int j) {
    const std::uint8_t* p = part.texture.row<std::uint8_t>((j % h + h) % h) + 3 * ((i % w + w) % w);
    return Vector3f(linear_from_srgb(float(p[0]) / 255), linear_from_srgb(float(p[1]) / 255),
                    linear_from_srgb(float(p[2]) / 255));
  };
  return (1 - b) * ((1 - a) * texel(x0, y0) + a * texel(x0 + 1, y0)) +
         b * ((1 - a) * texel(x0, y0 + 1) + a * texel(x0 + 1, y0 + 1));
}

Vector3f LitScene::object_radiance(const Ray& ray, const Hit& hit) const {
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
  const Material& m = part.at(point);
  if (m.unlit) return m.colors[0];
  const float mirrored = mirror(m, cos_v);
  Vector3f radiance = (1 - mirrored) * base_color(part, m, hit, point).cwiseProduct(light);
  const Vector3f start = point + offset_ * normal;
  for (const Lamp& lamp : lamps_) {
    const Vector3f way = lamp.position - point;
    const float distance = way.norm();
    const Vector3f shine =
        lamp.intensity * (gloss(m, normal, way / distance, view, lamp.radius / distance) / (distance * distance));
    if (shine.maxCoeff() > 5e-4f && !blocked(start, lamp.position - start)) radiance += shine;
  }
  if (mirrored > 2e-3f) {
    const Vector3f away = 2 * cos_v * normal - view;
    if (rays_->occluded({start, away}))
      radiance += mirrored * .3f * light.cwiseProduct(m.colors[0]);
    else if (room_.contains(start))
      radiance += mirrored * (m.soft_mirror ? blurred_room(start, away, 2 * m.roughness * m.roughness)
                                            : room_radiance(room_.hit(start, away)));
  }
  return radiance;
}

}  // namespace lumihull::rig
