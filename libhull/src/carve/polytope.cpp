#include "polytope.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::hull {

Polytope::Polytope(const Box& box) {
  const auto corner = [&](int i) -> Eigen::Vector3d {
    return {i & 1 ? box.max.x() : box.min.x(), i & 2 ? box.max.y() : box.min.y(), i & 4 ? box.max.z() : box.min.z()};
  };
  for (const auto& f : {std::array{0, 2, 6, 4}, std::array{1, 3, 7, 5}, std::array{0, 1, 5, 4}, std::array{2, 3, 7, 6},
                        std::array{0, 1, 3, 2}, std::array{4, 5, 7, 6}})
    faces_.push_back({corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3])});
}

void Polytope::clip(const HalfSpace& h) {
  Polygon section;
  std::vector<Polygon> kept;
  bool cut = false;
  for (const Polygon& face : faces_) {
    Polygon rest;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Eigen::Vector3d &a = face[i], &b = face[(i + 1) % face.size()];
      const double da = h.normal.dot(a) + h.offset, db = h.normal.dot(b) + h.offset;
      if (da >= 0) rest.push_back(a);
      if ((da >= 0) != (db >= 0)) {
        const Eigen::Vector3d p = a + da / (da - db) * (b - a);
        rest.push_back(p);
        section.push_back(p);
      }
      cut |= da < 0;
    }
    if (rest.size() >= 3) kept.push_back(std::move(rest));
  }
  if (!cut) return;
  faces_ = std::move(kept);
  if (section.size() < 3 || faces_.empty()) return;
  // The new face: the points around their middle, by angle.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : section) middle += p / double(section.size());
  const Eigen::Vector3d n = h.normal.normalized();
  const Eigen::Vector3d e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  const auto angle = [&](const Eigen::Vector3d& p) { return std::atan2((p - middle).dot(e2), (p - middle).dot(e1)); };
  std::sort(section.begin(), section.end(), [&](const auto& p, const auto& q) { return angle(p) < angle(q); });
  // Each point came from two faces.
  const double near = 1e-12 * (section.front() - middle).squaredNorm();
  section.erase(std::unique(section.begin(), section.end(),
                            [&](const auto& p, const auto& q) { return (p - q).squaredNorm() <= near; }),
                section.end());
  if (section.size() >= 3) faces_.push_back(std::move(section));
}

Box Polytope::bounds() const {
  Box box;
  box.min = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  box.max = -box.min;
  for (const Polygon& face : faces_)
    for (const Eigen::Vector3d& p : face) box.min = box.min.cwiseMin(p), box.max = box.max.cwiseMax(p);
  return box;
}

}  // namespace lumihull::hull
