// Light that does not depend on the camera: straight from the lamps, and along paths that bounce between room and
// objects. Lamps are asked at each place of a path (their light is kept in maps and vertices), so that paths need to
// find only what glows: the ceiling.

#include <lumihull/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "lit_scene.h"
#include "objects/material.h"
#include "objects/noise.h"

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

constexpr float kDarkPath = .01f;  ///< a path of less light than this ends

/// Direction around +z with density cos / pi.
Vector3f cosine_direction(const Vector2f& p) {
  const float r = std::sqrt(p.x()), phi = 6.2831853f * p.y();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.f, 1 - p.x()))};
}

}  // namespace

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
  light_.resize(mesh_.vertices.size());
  parallel_chunks(job, light_.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      light_[i] = lamps_at(mesh_.vertices[i], normals_[i], options.lamp_rays, mix(i));
  });
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

  job.begin("light of the room", 2 * nodes.size());
  parallel_chunks(
      job, nodes.size(), 256,
      [&](std::size_t first, std::size_t last) {
        // One set of rays for all nodes: errors then vary smoothly, not as grain.
        for (std::size_t i = first; i < last; ++i)
          *nodes[i].light = lamps_at(nodes[i].at.point, nodes[i].at.normal, options.lamp_rays, 1);
      },
      true);
  std::vector<Vector3f> indirect(nodes.size());
  parallel_chunks(
      job, nodes.size(), 256,
      [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
          const RoomHit& at = nodes[i].at;
          const Eigen::Matrix3f frame = frame_around(at.normal);
          // Maps are rectangles that reach beyond walls; what is there counts for places beside them.
          const Vector3f start = room_.moved_inside(at.point + offset_ * at.normal, offset_);
          Vector3f sum = Vector3f::Zero();
          for (int k = 0; k < options.ambient_rays; ++k)
            sum += path_light({start, frame * cosine_direction(spread_point(k, options.ambient_rays, 2))}, nullptr,
                              mix(3, std::uint64_t(k)), options.bounces, false);
          indirect[i] = sum / float(options.ambient_rays);
        }
      },
      true);
  job.end();
  for (std::size_t i = 0; i < nodes.size(); ++i) *nodes[i].light += indirect[i];
}

void LitScene::look_at_materials() {
  albedo_.assign(mesh_.vertices.size(), Vector3f::Zero());
  glow_.assign(mesh_.vertices.size(), Vector3f::Zero());
  std::vector<bool> done(mesh_.vertices.size(), false);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh_.triangles[t][std::size_t(k)];
      if (done[v]) continue;
      done[v] = true;
      const Part& part = parts_[object_of_[t]];
      const std::size_t material = part.material_index(mesh_.vertices[v], std::uint32_t(t));
      const Material& m = part.materials[material];
      Hit corner;
      corner.triangle = std::uint32_t(t);
      corner.b1 = k == 1 ? 1.f : 0.f, corner.b2 = k == 2 ? 1.f : 0.f;
      if (m.unlit)
        glow_[v] = m.colors[0];
      else
        // What it mirrors is scattered here: energy is kept, its direction is not.
        albedo_[v] = (1 - mean_mirror(m)) * base_color(part, material, corner, mesh_.vertices[v]) +
                     Vector3f::Constant(mean_mirror(m));
    }
}

LitScene::Touch LitScene::touch(const Ray& ray, const Hit& hit) const {
  const auto& [ia, ib, ic] = mesh_.triangles[hit.triangle];
  const float b0 = 1 - hit.b1 - hit.b2;
  const auto at = [&](const std::vector<Vector3f>& values) -> Vector3f {
    return b0 * values[ia] + hit.b1 * values[ib] + hit.b2 * values[ic];
  };
  Touch touch;
  touch.point = at(mesh_.vertices);
  touch.normal = at(normals_).normalized();
  if (touch.normal.dot(ray.direction) > 0) touch.normal = -touch.normal;
  touch.albedo = at(albedo_);
  touch.radiance = at(glow_) + touch.albedo.cwiseProduct(at(light_));
  return touch;
}

Vector3f LitScene::path_light(const Ray& first_ray, const Hit* first, std::uint64_t turn, int bounces,
                              bool room_done) const {
  Vector3f sum = Vector3f::Zero(), share = Vector3f::Ones();
  Ray ray = first_ray;
  const auto meets_ball = [&] {
    const Vector3f to = center_ - ray.origin;
    const float along = to.dot(ray.direction), outside = to.squaredNorm() - radius_ * radius_;
    return outside <= 0 || (along > 0 && along * along > outside * ray.direction.squaredNorm());
  };
  for (int bounce = 0; room_.contains(ray.origin); ++bounce) {
    Hit hit;
    if (bounce == 0 && first)
      hit = *first;
    else if (rays_ && meets_ball())
      hit = rays_->hit(ray);
    Vector3f point, normal, albedo;
    if (hit && !room_.pedestal_between(ray.origin, hit.t * ray.direction)) {
      const Touch on = touch(ray, hit);
      sum += share.cwiseProduct(on.radiance);
      point = on.point, normal = on.normal, albedo = on.albedo;
    } else {
      const RoomHit wall = room_.hit(ray.origin, ray.direction);
      if (wall.surface == Room::kCeiling) return sum + share.cwiseProduct(room_.enclosure().ceiling);
      albedo = room_.mean_paint(wall.surface);
      sum += share.cwiseProduct(room_.enclosure().glow + albedo.cwiseProduct(room_light(wall)));
      if (room_done) return sum;
      point = wall.point, normal = wall.normal;
    }
    share = share.cwiseProduct(albedo);
    if (bounce + 1 >= bounces || share.maxCoeff() < kDarkPath) return sum;
    const std::uint64_t random = mix(turn, 0x100 + std::uint64_t(bounce));
    ray.origin = point + offset_ * normal;
    ray.direction = frame_around(normal) * cosine_direction({unit_float(random), unit_float(mix(random))});
  }
  return sum;
}

void LitScene::light_objects(const LightOptions& options, Job& job) {
  if (light_.empty()) return;
  std::vector<Vector3f> indirect(light_.size());
  job.begin("light on the objects", light_.size());
  parallel_chunks(
      job, light_.size(), 256,
      [&](std::size_t first, std::size_t last) {
        std::vector<Ray> rays(static_cast<std::size_t>(options.ambient_rays));
        std::vector<Hit> hits(rays.size());
        for (std::size_t i = first; i < last; ++i) {
          const Vector3f& normal = normals_[i];
          const std::uint64_t turn = mix(i);
          const Eigen::Matrix3f frame = frame_around(normal);
          for (int k = 0; k < options.ambient_rays; ++k)
            rays[std::size_t(k)] = {mesh_.vertices[i] + offset_ * normal,
                                    frame * cosine_direction(spread_point(k, options.ambient_rays, turn))};
          rays_->hit(rays, hits);
          Vector3f sum = Vector3f::Zero();
          for (std::size_t k = 0; k < rays.size(); ++k)
            sum += path_light(rays[k], &hits[k], mix(turn, k), options.bounces, true);
          indirect[i] = sum / float(rays.size());
        }
      },
      true);
  job.end();
  for (std::size_t i = 0; i < light_.size(); ++i) light_[i] += indirect[i];
  smooth_light();
}

void LitScene::smooth_light() {
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

}  // namespace lumihull::rig
