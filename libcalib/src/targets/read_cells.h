#pragma once

#include <lumihull/calib/ellipse.h>
#include <lumihull/calib/light_plane.h>
#include <lumihull/calib/target_family.h>

#include <span>
#include <vector>

namespace lumihull::calib {

/// How the circles of a design look, as far as reading them goes.
struct CircleLook {
  double ring_ratio = 0.55;  ///< radius of a ring's light centre / outer radius
  bool solid_light = false;  ///< light circles are discs lighter than the paper
  /// Of solid light ones: what they are lighter than the paper by, over what dark ones are darker by; > 0.
  double light_contrast = 1;
};

/// What the cells of a grid are, and how well they tell themselves apart.
struct CellReading {
  std::vector<Cell> cells;  ///< columns x rows, row-major
  double separation =
      0;               ///< expected difference between a dark and a light centre, of the paper's light; 0: unreadable
  double blur_px = 0;  ///< sigma that was assumed
  double dark_spread = 0;  ///< standard deviation of dark circles' centres / the ink's contrast
  double worst = 0;        ///< largest |x - expected| of a cell that was read, over the difference of disc and ring
  double contrast = 0;     ///< of dark circles' centres, of the paper's light
};

/// Reads a grid of circles by the light in their centres. circles: columns x rows, row-major, measured or predicted;
/// states: circles that are not `good` (hidden, say) are unknown. certainly_dark: how many circles are dark in any
/// case.
///
/// Light is counted relative to the paper between the circles, so that shading drops out. How light the centre of a
/// ring becomes depends on blur: with s = sigma / semi-axes, a disc of light keeps P(|N(0, s²)| < 1) of its contrast at
/// its centre; dark and light centres are told apart halfway between what both should be, the zone between is unknown.
/// Solid light circles lie on the paper's other side: what is nearer to the paper than half of the way is unknown.
CellReading read_cells(const LightPlane& plane, std::span<const Ellipse> circles, std::span<const EllipseState> states,
                       int columns, int certainly_dark, const CircleLook& look);

}  // namespace lumihull::calib
