#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/renderer.h>

#include <cstddef>
#include <memory>

namespace lumihull::slf {

struct LumigraphOptions {
  int photographs = 3;               ///< blended at a point, 1 … 16
  double angle_power = 3;            ///< weights fall like 1 / angle^power; >= 0
  double resolution_penalty = 0.05;  ///< radians of angle that a photograph of half the resolution is put back; >= 0
  double visibility_offset =
      0.003;                ///< how far beside the surface a shadow starts to count, in diagonals of the mesh's box
  double min_cosine = 0.1;  ///< photographs that see the surface flatter than this fade out, 0 … 1
  double erosion_px = 0;    ///< rim of the photographs' silhouettes that counts next to nothing, px
  double feather_px = 1;    ///< width over which the weight rises to full inside of it, px
  /// Pixels of a softer mask than this take the colour of the nearest one beyond it, 0 … 1. Low: rims as they were
  /// photographed, mixed with the background (closer to held-out photographs); 0.98: no trace of the background.
  double edge_alpha = 0.5;
  double border_px = 8;  ///< width over which a photograph fades out at its picture's border, px
  std::size_t cache_bytes = std::size_t(2) << 30;  ///< memory for decoded photographs (4 bytes a pixel each)
};

/// New views by blending photographs at each ray's surface point: the unstructured lumigraph (Buehler, Bosse, McMillan,
/// Gortler & Cohen 2001). Of the photographs that see the point (shadow rays, no photograph taken on trust) the k best
/// by
///
///     penalty_i = angle between the new ray and photograph i's ray + resolution penalty
///     weight_i  = (1 - penalty_i / penalty_{k+1}) / penalty_i^power x border x cosine x soft silhouette
///
/// are mixed, as sRGB values: a photograph's weight is zero before another takes its place, so that nothing jumps where
/// the camera moves; and a view from where a photograph was taken is that photograph.
class LUMIHULL_API Lumigraph {
 public:
  /// Mesh and scene must outlive the object. Photographs are read when first needed and kept within cache_bytes.
  /// Errors: invalid_argument (options), bad_input (views), degenerate (no photographs).
  Lumigraph(const hull::Mesh& mesh, const hull::RayScene& scene, PhotoSet photos, const LumigraphOptions& options = {});
  Lumigraph(Lumigraph&&) noexcept;
  Lumigraph& operator=(Lumigraph&&) noexcept;
  ~Lumigraph();

  /// The result depends neither on the number of threads nor on what is in the cache. Points that no photograph sees
  /// take the colours around them in the picture.
  Rendering render(const View& view, const RenderOptions& options, Job& job);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumihull::slf
