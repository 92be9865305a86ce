#pragma once

#include <lumihull/calib/target_family.h>

#include <Eigen/Core>
#include <vector>

namespace lumihull::calib {

/// The outlines of a grid's dark cells as closed polygons in units of cells, top left corner (0, 0): each edge between
/// dark and light (and the outside, which is light) once, straight runs joined. Filled by the even-odd rule they are
/// the dark cells, without seams between neighbours.
std::vector<std::vector<Eigen::Vector2i>> dark_outlines(const std::vector<Cell>& cells, int grid);

}  // namespace lumihull::calib
