#pragma once

#include <lumihull/hull/mesh.h>
#include <lumihull/slf/light_field.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sphere_grid.h"

namespace lumihull::slf {

/// Where what is mirrored is taken to be: on a sphere around the object. So places of a large object see a lamp that is
/// near in different directions.
struct Surroundings {
  Eigen::Vector3f center{0, 0, 0};
  float inverse_radius = 0;  ///< 0: infinitely far away
};

/// Which of a grid's nodes a place mirrors to the eye, and how much more flatly seen places mirror (grazing()).
struct MirrorPlace {
  SphereGrid::Place at;
  float grazing = 0;
};

/// How much more a place mirrors that is seen flatly. Fresnel's reflectance rises with the fifth power; where normals
/// are a mesh's, and not that well known, the third was measured to be better (README).
inline float grazing(float cosine) {
  const float a = 1 - std::clamp(cosine, 0.0f, 1.0f);
  return a * a * a;
}

/// Where a mirror with normal n (of unit length) shows what `to_eye` looks along.
inline Eigen::Vector3f mirrored(const Eigen::Vector3f& to_eye, const Eigen::Vector3f& normal) {
  return 2 * normal.dot(to_eye) * normal - to_eye;
}

/// The direction, as seen from the surroundings' centre, of what a ray of unit length from a point within them meets.
inline Eigen::Vector3f met(const Surroundings& around, const Eigen::Vector3f& point, const Eigen::Vector3f& ray) {
  const Eigen::Vector3f from = around.inverse_radius * (point - around.center);
  const float along = from.dot(ray);
  return from + (std::sqrt(std::max(0.0f, along * along + 1 - from.squaredNorm())) - along) * ray;
}

inline MirrorPlace mirror_place(const SphereGrid& grid, const Surroundings& around, const Eigen::Vector3f& point,
                                const Eigen::Vector3f& normal, const Eigen::Vector3f& eye) {
  const Eigen::Vector3f to_eye = (eye - point).stableNormalized();
  return {grid.at(met(around, point, mirrored(to_eye, normal))), grazing(to_eye.dot(normal))};
}

/// Of a place of a triangle, by its barycentric coordinates; normals: of the mesh's vertices, unit length.
inline MirrorPlace mirror_place(const SphereGrid& grid, const Surroundings& around, const hull::Mesh& mesh,
                                const std::vector<Eigen::Vector3f>& normals, std::uint32_t triangle, float b1, float b2,
                                const Eigen::Vector3f& eye) {
  const auto& t = mesh.triangles[triangle];
  const auto between = [&](const std::vector<Eigen::Vector3f>& of) -> Eigen::Vector3f {
    return (1 - b1 - b2) * of[t[0]] + b1 * of[t[1]] + b2 * of[t[2]];
  };
  return mirror_place(grid, around, between(mesh.vertices), between(normals).stableNormalized(), eye);
}

/// A stored reflection's values, as mirrored_light() wants them.
inline std::vector<Eigen::Vector3f> light_of(const LightFieldReflection& r) {
  std::vector<Eigen::Vector3f> light;
  for (const auto& [map, scale] : {std::pair(&r.light, r.light_scale), std::pair(&r.grazing, r.grazing_scale)})
    for (int y = 0; y < map->height(); ++y)
      for (int x = 0; x < map->width(); ++x) {
        const std::uint8_t* b = map->row<std::uint8_t>(y) + 3 * x;
        light.push_back(scale.scale / 255 * Eigen::Vector3f(b[0], b[1], b[2]) +
                        Eigen::Vector3f::Constant(scale.offset));
      }
  return light;
}

/// What is mirrored there: light holds the values at all nodes, and then, as many, those that come on top of them,
/// times grazing().
inline Eigen::Vector3f mirrored_light(std::span<const Eigen::Vector3f> light, const MirrorPlace& place) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t node = place.at.node[k];
    sum += place.at.weight[k] * (light[node] + place.grazing * light[light.size() / 2 + node]);
  }
  return sum;
}

}  // namespace lumihull::slf
