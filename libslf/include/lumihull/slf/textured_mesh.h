#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/photos.h>

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace lumihull::slf {

/// A mesh with a texture. uv has one entry for each triangle's corners: a vertex may have several places in the
/// texture.
struct TexturedMesh {
  hull::Mesh mesh;
  std::vector<std::array<Eigen::Vector2f, 3>> uv;  ///< 0 … 1, (0, 0) = upper left corner of the picture (as in glTF)
  Image texture;                                   ///< 8-bit sRGB, 3 channels
};

/// Throws Error{bad_input} where indices, coordinates and picture do not fit together.
LUMIHULL_API void validate(const TexturedMesh& textured, const std::string& name);

struct TextureOptions {
  int max_side = 4096;      ///< largest width and height of the texture, 64 … 16384
  double texel_px = 0.7;    ///< size of a texel in pixels of the photographs, at the median over the surface
  double cosine_power = 3;  ///< a photograph's weight falls with cosine^power of its viewing angle; >= 0
  double resolution_power =
      1;                     ///< ... and with pixel^(-2 power), pixel: its size at the surface, as distance / f; >= 0
  double min_cosine = 0.15;  ///< flatter views are not used where there is any other; 0 … 1
  double visibility_offset =
      0.003;              ///< how far beside the surface a shadow starts to count, in diagonals of the mesh's box
  double erosion_px = 0;  ///< rim of the photographs' silhouettes that counts next to nothing, px
  double feather_px = 1;  ///< width over which the weight rises to full inside of it, px
  /// Pixels of a softer mask than this take the colour of the nearest one beyond it, 0 … 1; see LumigraphOptions.
  double edge_alpha = 0.5;
};

/// What mean_texture found out on its way.
struct TextureReport {
  std::size_t charts = 0;
  double texel_size = 0;    ///< world units
  double filled_share = 0;  ///< share of the surface texels that no photograph saw
};

/// Gives a mesh a texture: the weighted mean (of sRGB values), over the photographs that see it, of every texel.
///
/// Places that nobody saw take the colours around them on the surface. Photographs are read once each, one after the
/// other, so that memory does not grow with their number: about 48 bytes a texel.
/// Errors: invalid_argument (options), bad_input (mesh, views), degenerate (no photographs, no triangles), and whatever
/// the photographs' reader throws.
LUMIHULL_API TexturedMesh mean_texture(const hull::Mesh& mesh, const PhotoSet& photos, const TextureOptions& options,
                                       Job& job, TextureReport* report = nullptr);

}  // namespace lumihull::slf
