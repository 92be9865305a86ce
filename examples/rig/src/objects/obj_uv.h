#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::rig {

/// The texture coordinates of an OBJ file's faces, polygons split into fans as hull::read_mesh splits them, so that the
/// lists run in parallel. `name` is used in errors. Errors: bad_input naming file and line.
std::vector<std::array<Eigen::Vector2f, 3>> obj_texture_coordinates(std::string_view text, const std::string& name);

}  // namespace lumihull::rig
