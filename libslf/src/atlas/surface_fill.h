#pragma once

#include <lumihull/base/image.h>
#include <lumihull/hull/mesh.h>

#include <cstddef>
#include <vector>

#include "atlas.h"
#include "render/frame.h"

namespace lumihull::slf {

/// Turns weighted sums into colours (weight 1). Texels without any take the colours around them on the surface: known
/// colours are gathered at the mesh's vertices, spread over the edges to those that have none, and interpolated back.
/// Pieces of the surface that nobody saw at all take the mean colour. Returns how many texels were filled.
std::size_t fill_surface(const hull::Mesh& mesh, const Atlas& atlas, std::vector<BlendColor>& texels);

/// The texture as 8-bit sRGB. Between the charts it continues smoothly, so that it compresses well and smaller versions
/// of it (mip levels) do not darken at the seams.
Image texture_picture(const Atlas& atlas, const std::vector<BlendColor>& texels);

}  // namespace lumihull::slf
