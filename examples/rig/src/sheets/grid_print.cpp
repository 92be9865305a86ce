#include <lumihull/base/error.h>
#include <lumihull/rig/flat_print.h>

#include <cmath>

#include "flat_shapes.h"

namespace lumihull::rig {

using Eigen::Vector2d;
using Eigen::Vector3f;

FlatPrint print_of(const calib::PointGrid& grid, const Vector3f& ink, const Vector3f& paper) {
  if (grid.columns < 1 || grid.rows < 1 || grid.columns > 1000 || grid.rows > 1000)
    throw Error(ErrorCode::invalid_argument, "must have 1 to 1000 columns and rows", "point grid");
  if (!(std::isfinite(grid.spacing_m) && grid.spacing_m > 0))
    throw Error(ErrorCode::invalid_argument, "the spacing must be above 0", "point grid");
  const double a = grid.spacing_m;
  FlatPrint print;
  print.paper = paper;
  if (grid.kind == calib::PointGrid::Kind::circles) {
    print.low = {-a, -a}, print.high = Vector2d(grid.columns, grid.rows) * a;
    for (int i = 0; i < grid.columns * grid.rows; ++i)
      print.shapes.push_back(disc(grid.point(i), grid.circle_radius_m(), ink));
  } else {
    print.low = {-2 * a, -2 * a}, print.high = Vector2d(grid.columns + 1, grid.rows + 1) * a;
    for (int y = -1; y < grid.rows; ++y)
      for (int x = -1; x < grid.columns; ++x)
        if ((x + y) % 2 == 0) print.shapes.push_back(rectangle(Vector2d(x, y) * a, Vector2d(x + 1, y + 1) * a, ink));
  }
  return print;
}

}  // namespace lumihull::rig
