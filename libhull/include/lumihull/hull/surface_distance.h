#pragma once

#include <lumihull/base/api.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

namespace lumihull::hull {

/// A mesh made ready to say how far points are from it. Immutable; any number of threads may ask it.
class LUMIHULL_API SurfaceDistance {
 public:
  /// Copies what it needs. Errors: bad_input (bad indices), invalid_argument (an empty mesh), out_of_memory.
  explicit SurfaceDistance(const Mesh& mesh);
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;
  ~SurfaceDistance();

  /// From the nearest point of the surface, world units, exact to single precision.
  float operator()(const Eigen::Vector3f& p) const;
  /// Whether a closed mesh encloses the point: rays in three directions cross the surface an odd number of times in
  /// most of them.
  bool encloses(const Eigen::Vector3f& p) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// `count` points evenly over a mesh by area: one in each of `count` equal shares of the area, triangle after triangle.
/// The same points for the same mesh. Errors: bad_input (bad indices), invalid_argument (a mesh without area).
LUMIHULL_API std::vector<Eigen::Vector3f> surface_points(const Mesh& mesh, std::size_t count);

}  // namespace lumihull::hull
