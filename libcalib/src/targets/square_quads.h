#pragma once

#include <lumihull/base/image.h>
#include <lumihull/calib/target_family.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

namespace lumihull::calib {

/// A quadrangle in a picture that reads as a target: corners to one or two px, clockwise from any of them.
struct SquareQuad {
  int family = 0;  ///< index into the finder's families
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners;
};

/// Finds the quadrangles of square families by libapriltag, which is given each family's cells as its table: AprilTag's
/// own and ArUco's alike. Immutable: any number of threads may search.
class SquareFinder {
 public:
  explicit SquareFinder(const std::vector<TargetFamily>& families);
  SquareFinder(SquareFinder&&) noexcept;
  ~SquareFinder();

  /// grey: 8 bits, 1 channel. Quadrangles are looked for in the picture made smaller by `decimate` (>= 1), ids are read
  /// in the picture as it is. One thread: libapriltag's answer would depend on their number.
  std::vector<SquareQuad> find(const Image& grey, double decimate) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// Number of wrong cells that may be corrected: less than half of the family's distance, and so few that a grid of
/// chance decodes at most once in a thousand (or none are).
int correctable_cells(const TargetFamily& family);

}  // namespace lumihull::calib
