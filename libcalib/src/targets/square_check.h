#pragma once

#include <lumihull/calib/light_plane.h>
#include <lumihull/calib/target_family.h>

#include <Eigen/Core>
#include <vector>

namespace lumihull::calib {

/// What light does on a target: levels of ink and paper as linear functions of the pixel's place.
struct SquareLevels {
  Eigen::Vector2d middle{0, 0};
  double dark = 0, light = 1;      ///< at `middle`
  Eigen::Vector2d slope{0, 0};     ///< relative change of the light, 1/px
  double shade(const Eigen::Vector2d& p) const { return std::max(0.05, 1 + slope.dot(p - middle)); }
};

/// How a square's cells, with a ring of paper around them, compare with those of an id.
struct SquareReading {
  int quarter_turns = 0;  ///< how often the grid as it was read has to be turned by 90°, clockwise, to stand upright
  int wrong = 0;          ///< data cells that read the other way
  double rms = 0;         ///< of measured − expected, in units of light − dark, without the wrong cells
  double worst = 0;       ///< its largest amount, without the wrong cells
};

/// Reads the cells by their mean in the picture and compares them with what the id's cells look like when blurred.
///
/// pixel_from_grid: (0, 0) … (grid, grid) are the black square's corners, clockwise. blur_px: sigma.
SquareReading read_square(const LightPlane& plane, const Eigen::Matrix3d& pixel_from_grid, const SquareLevels& levels,
                          double blur_px, int grid, const std::vector<Cell>& cells);

/// Row-major cells, grid x grid, turned by 90° counter-clockwise `turns` times: as a camera sees a target which has to be
/// turned clockwise that often.
std::vector<Cell> turned(const std::vector<Cell>& cells, int grid, int turns);

}  // namespace lumihull::calib
