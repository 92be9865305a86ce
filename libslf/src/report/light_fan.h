#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/light_field.h>

#include <vector>

namespace lumihull::slf {

/// How far a fan's outer views are turned from its middle one, degrees.
inline constexpr double kFanDegrees = 40;

/// Close views of one place of the object, from a fan of directions: pictures of side x side pixels in a row from
/// -kFanDegrees to kFanDegrees. The place is the one whose lightness changes most with the eye by what the terms say,
/// of those that the whole fan sees (where there is none: that most of it sees). In the middle stands the node that
/// sees the place best; the others are turned from it about the photographs' up. Empty where the field has no terms,
/// or no place that three nodes see from the front. count >= 2. `scene` must be made from the field's mesh.
std::vector<View> light_fan(const LightField& field, const hull::RayScene& scene, int count, int side);

}  // namespace lumihull::slf
