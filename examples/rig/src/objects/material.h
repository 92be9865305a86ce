#pragma once

#include <lumihull/rig/object.h>

namespace lumihull::rig {

/// Base colour, linear, at q: the position in units of the object's size, from the middle of its foot.
Eigen::Vector3f pattern_color(const Material& material, const Eigen::Vector3f& q);

/// Cook-Torrance reflection of a lamp in direction `l` towards `v` (unit vectors, n·l > 0, n·v > 0): D F G times n·l,
/// GGX distribution (Walter et al. 2007, eq. 33), Smith's joint masking, Schlick's Fresnel. In units where a white
/// diffuse surface has radiance n·l (that is: pi times the usual BRDF).
/// `spread` is the sine of the lamp's angular radius; it widens the lobe (Karis 2013), and energy is kept.
float gloss(const Material& material, const Eigen::Vector3f& n, const Eigen::Vector3f& l, const Eigen::Vector3f& v,
            float spread);

/// The mean of mirror() over a hemisphere of diffuse light: what the diffuse part lacks.
float mean_mirror(const Material& material);

/// Mirror reflectance of the surroundings at the angle with cosine `cos_v` (Schlick, dimmed by roughness).
float mirror(const Material& material, float cos_v);

}  // namespace lumihull::rig
