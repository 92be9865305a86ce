#pragma once

#include <Eigen/Core>

// Distances of straight pieces, and of solids from them.

namespace lumihull::capture::internal {

struct Segment {
  Eigen::Vector3d from, to;
};

double distance(const Segment& segment, const Eigen::Vector3d& point);

/// Exact for any two segments: parallel, crossing, of length zero.
double distance(const Segment& a, const Segment& b);

}  // namespace lumihull::capture::internal
