#pragma once

#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/renderer.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "color.h"
#include "photos/outline.h"
#include "view_rays.h"

namespace lumihull::slf {

/// One ray's meeting with the surface.
struct SurfaceSample {
  std::uint32_t pixel;  // within the tile, y * width + x; a pixel's samples follow one another
  hull::Hit hit;        // t = depth: z in the camera's frame
  Eigen::Vector3f point;
  bool whole;  // the pixel's samples stand for all of its rays, however many there are
};

struct Tile {
  int x0, y0, width, height;
};

/// A view cut into tiles, each with n x n rays a pixel, and the pictures that come of it. Tiles may be traced and
/// resolved at the same time by different threads.
class Frame {
 public:
  /// The scene is made from the mesh; both must outlive the frame. edges: the mesh's (mesh_edges), to save finding them
  /// where options.adaptive asks for them. Throws Error{invalid_argument} for bad options or a camera that is not
  /// valid.
  Frame(const View& view, const RenderOptions& options, const hull::Mesh& mesh, const hull::RayScene& scene,
        const std::vector<MeshEdge>* edges = nullptr);

  std::size_t tiles() const { return std::size_t(columns_) * rows_; }
  Tile tile(std::size_t i) const;
  Eigen::Vector3d center() const { return center_; }

  /// The rays of a tile that hit the surface, in order of their pixels.
  std::vector<SurfaceSample> trace(const Tile& tile) const;

  /// Averages the samples' colours (colors.size() == samples.size()) into the tile's pixels. Pixels of which no sample
  /// has a weight are left to `finish`.
  void resolve(const Tile& tile, const std::vector<SurfaceSample>& samples, const std::vector<BlendColor>& colors);

  /// Colours the pixels without colour from those around them and hands out the pictures.
  Rendering finish();

 private:
  /// The surroundings of a hit on the plane of its triangle. `off` in pixels from the hit.
  struct Plane {
    hull::Hit center;
    Eigen::Vector2f by_scale, by_b1, by_b2;

    hull::Hit at(const Eigen::Vector2f& off) const {
      const float scale = 1 / (1 + by_scale.dot(off));
      return {center.triangle, center.t * scale, (center.b1 + by_b1.dot(off)) * scale,
              (center.b2 + by_b2.dot(off)) * scale};
    }
    /// Whether n x n samples around the hit lie on the triangle, or not far beside it.
    bool holds(int n) const;
  };

  /// slopes: d direction / d pixel
  Plane plane(const hull::Hit& hit, const Eigen::Matrix<float, 3, 2>& slopes) const;
  SurfaceSample sample(std::uint32_t pixel, const hull::Hit& hit) const;
  /// n x n rays for each of the pixels; hits in their order.
  std::vector<hull::Hit> cast(const Tile& tile, const std::vector<std::uint32_t>& pixels, int n) const;

  View view_;
  RenderOptions options_;
  const hull::Mesh& mesh_;
  const hull::RayScene& scene_;
  ViewRays rays_;
  int columns_, rows_;
  Eigen::Vector3d center_;
  Eigen::AlignedBox2d seen_;          // the mesh's bounds, (x / z, y / z) in the camera's frame
  bool adaptive_;                     // one ray in a pixel that is not marked
  std::vector<std::uint8_t> marked_;  // pixels that an outline passes through
  Rendering out_;
  std::vector<std::vector<std::uint32_t>> holes_;  // pixels, by tile
};

}  // namespace lumihull::slf
