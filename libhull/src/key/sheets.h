#pragma once

#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/calib/calibrate.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "coarse_hull.h"

namespace lumihull::hull {

/// What a pixel may show of a sheet, unless something stands before it.
enum SheetPart : std::uint8_t {
  kNoSheet = 0,   ///< surely none
  kPaperRim = 1,  ///< maybe paper: beyond what is printed
  kPrint = 2,     ///< print, and the paper between
};

/// A printed target on its sheet of paper, in the world.
struct Sheet {
  Eigen::Vector3d center, normal;  ///< the normal points to the cameras
  Eigen::Vector3d along, across;   ///< from the centre to the middles of its printed sides
  /// How far from the centre there may be paper: along, across, against along, against across; 1 is a printed side.
  std::array<double, 4> reach{kFarthest, kFarthest, kFarthest, kFarthest};

  static constexpr double kFarthest = 2.2;
};

/// The placed targets of solved bodies, their paper as far as it can reach. eyes: the cameras' mean place.
std::vector<Sheet> sheets_of(std::span<const calib::CalibratedBody> bodies, const Eigen::Vector3d& eyes);

/// SheetPart of each pixel of a view, 8 bits.
Image sheets_in(const CoarseView& view, std::span<const Sheet> sheets);

}  // namespace lumihull::hull
