#pragma once

#include <lumihull/hull/field.h>

#include <Eigen/Core>
#include <vector>

namespace lumihull::hull {

/// normal · x + offset >= 0
struct HalfSpace {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0;
};

/// A convex polyhedron that half-spaces are cut off from.
class Polytope {
 public:
  explicit Polytope(const Box& box);
  void clip(const HalfSpace& half_space);
  bool empty() const { return faces_.empty(); }
  Box bounds() const;

 private:
  using Polygon = std::vector<Eigen::Vector3d>;
  std::vector<Polygon> faces_;
};

}  // namespace lumihull::hull
