#pragma once

#include <lumihull/base/api.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace lumihull::hull {

inline constexpr std::uint32_t kNoHit = std::numeric_limits<std::uint32_t>::max();

struct Ray {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  ///< need not be unit length; distances are in its units
  float t_near = 0;
  float t_far = std::numeric_limits<float>::infinity();
};

struct Hit {
  std::uint32_t triangle = kNoHit;  ///< kNoHit: nothing was hit, the other fields are undefined
  float t = 0;                      ///< point = origin + t direction
  float b1 = 0, b2 = 0;             ///< point = (1 - b1 - b2) v0 + b1 v1 + b2 v2

  explicit operator bool() const { return triangle != kNoHit; }
};

/// Directions of rays that start at one point, by coordinate; all three of one length.
struct Directions {
  std::span<const float> x, y, z;  ///< need not be unit length; a ray with one that is not finite hits nothing

  std::size_t size() const { return x.size(); }
};

/// A mesh made ready for ray casting (Embree, robust mode). Immutable; any number of threads may ask it.
class LUMIHULL_API RayScene {
 public:
  /// Copies what it needs. Errors: bad_input (bad indices), out_of_memory.
  explicit RayScene(const Mesh& mesh);
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;
  ~RayScene();

  /// The first triangle along the ray, both sides counting.
  Hit hit(const Ray& ray) const;
  /// Whether anything lies between t_near and t_far.
  bool occluded(const Ray& ray) const;
  /// The same for many rays at once (coherent ones are faster); rays.size() == out.size().
  void hit(std::span<const Ray> rays, std::span<Hit> out) const;
  /// The same for the rays of a picture, the fastest: 16 next to one another in the list should be so in the picture,
  /// too. directions.size() == out.size().
  void hit(const Eigen::Vector3f& origin, const Directions& directions, std::span<Hit> out) const;
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> out) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumihull::hull
