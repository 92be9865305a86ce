#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/textured_mesh.h>

namespace lumihull::slf {

struct RenderOptions {
  int rays = 2;        ///< n x n rays a pixel, 1 … 8
  bool depth = false;  ///< fill Rendering::depth
  /// For speed: the n x n rays are cast only where one of the object's outlines passes through a pixel, or a pixel is
  /// not well inside of a triangle; elsewhere one ray finds the triangle, and samples are taken on its plane (2 x 2 for
  /// n = 2 … 4, 3 x 3 and 4 x 4 for more). Alpha is the same as without; colours nearly so.
  bool adaptive = false;
};

/// A new view.
struct Rendering {
  Image rgba;   ///< 8-bit sRGB, straight alpha = share of the pixel's rays that hit the object; (0, 0, 0, 0) where none
                ///< did
  Image depth;  ///< float, 1 channel: smallest z in the camera's frame over the pixel's rays, world units; infinity
                ///< where none hit; empty unless asked for
};

/// Renders a textured mesh from any camera, with its lens distortion. Colours are averaged over a pixel's rays as
/// sRGB values. `scene` must be made from textured.mesh. Errors: invalid_argument (options, camera), cancelled.
LUMIHULL_API Rendering render_texture(const TexturedMesh& textured, const hull::RayScene& scene, const View& view,
                                      const RenderOptions& options, Job& job);

/// Renders the bare geometry: grey, lit from the camera, smooth normals.
LUMIHULL_API Rendering render_shaded(const hull::Mesh& mesh, const hull::RayScene& scene, const View& view,
                                     const RenderOptions& options, Job& job);

}  // namespace lumihull::slf
