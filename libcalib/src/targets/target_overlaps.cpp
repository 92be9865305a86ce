// Whether targets of a board lie over one another, which paper can't do.
#include <algorithm>
#include <array>
#include <cmath>

#include "target_set_impl.h"

namespace lumihull::calib::internal {
namespace {

using Corners = std::array<Eigen::Vector3d, 4>;

/// The rectangle that a target's ink fills, on its board; in order around it.
struct Patch {
  Eigen::Vector3d center, normal;
  Corners corners;
  double radius = 0;
};

Patch patch_of(const TargetDesign& design, const Pose& board_from_target) {
  const bool circles = design.family.kind() == TargetKind::circles;
  const double half =
      circles ? 0.5 * (design.family.grid() - 1) * design.size_m + design.circle_radius_m() : 0.5 * design.size_m;
  const double x = half * design.scale_x, y = half * design.scale_y;
  Patch patch{
      board_from_target.translation, board_from_target.rotation * Eigen::Vector3d::UnitZ(), {}, std::hypot(x, y)};
  const std::array<Eigen::Vector2d, 4> signs{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (std::size_t i = 0; i < 4; ++i)
    patch.corners[i] = board_from_target * Eigen::Vector3d(signs[i].x() * x, signs[i].y() * y, 0);
  return patch;
}

/// Separating axes of two rectangles in one plane: apart where along some side's direction they do not meet.
bool overlap(const Patch& a, const Patch& b) {
  if ((a.center - b.center).norm() >= a.radius + b.radius) return false;
  // The same side of one plane: to 0.1 mm and about 0.06 degrees.
  if (a.normal.dot(b.normal) < 1 - 5e-7 || std::abs(a.normal.dot(b.center - a.center)) > 1e-4) return false;
  for (const Patch* sides : {&a, &b})
    for (const std::size_t next : {1u, 3u}) {
      const Eigen::Vector3d axis = (sides->corners[next] - sides->corners[0]).normalized();
      double low_a = INFINITY, high_a = -INFINITY, low_b = INFINITY, high_b = -INFINITY;
      for (std::size_t i = 0; i < 4; ++i) {
        low_a = std::min(low_a, axis.dot(a.corners[i]));
        high_a = std::max(high_a, axis.dot(a.corners[i]));
        low_b = std::min(low_b, axis.dot(b.corners[i]));
        high_b = std::max(high_b, axis.dot(b.corners[i]));
      }
      constexpr double kTouching = 1e-6;  // m; side by side is no overlap
      if (std::min(high_a, high_b) - std::max(low_a, low_b) < kTouching) return false;
    }
  return true;
}

}  // namespace

void check_overlaps(const TargetSet& set, const Board& board, const std::string& pointer, const Complain& complain) {
  std::vector<Patch> patches;
  for (const BoardTarget& target : board.targets)
    patches.push_back(patch_of(set.designs[std::size_t(target.design)], target.board_from_target));
  for (std::size_t b = 1; b < patches.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      if (overlap(patches[a], patches[b]))
        complain(pointer + "/targets/" + std::to_string(b) + "/board_from_target",
                 "a place that target " + std::to_string(a) + " does not cover");
}

}  // namespace lumihull::calib::internal
