#pragma once

#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/renderer.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "color.h"

namespace lumihull::slf {

/// One ray's meeting with the surface.
struct SurfaceSample {
  std::uint32_t pixel;  // within the tile, y * width + x; a pixel's samples follow one another
  hull::Hit hit;        // t = depth: z in the camera's frame
  Eigen::Vector3f point;
};

struct Tile {
  int x0, y0, width, height;
};

/// A view cut into tiles, each with n x n rays a pixel, and the pictures that come of it. Tiles may be traced and
/// resolved at the same time by different threads.
class Frame {
 public:
  /// Throws Error{invalid_argument} for bad options or a camera that is not valid.
  Frame(const View& view, const RenderOptions& options);

  std::size_t tiles() const { return std::size_t(columns_) * rows_; }
  Tile tile(std::size_t i) const;
  Eigen::Vector3d center() const { return center_; }

  /// The rays of a tile that hit the surface, in order of their pixels.
  std::vector<SurfaceSample> trace(const Tile& tile, const hull::RayScene& scene, const hull::Mesh& mesh) const;

  /// Averages the samples' colours (colors.size() == samples.size()) into the tile's pixels. Pixels of which no sample
  /// has a weight are left to `finish`.
  void resolve(const Tile& tile, const std::vector<SurfaceSample>& samples, const std::vector<BlendColor>& colors);

  /// Colours the pixels without colour from those around them and hands out the pictures.
  Rendering finish();

 private:
  View view_;
  RenderOptions options_;
  int columns_, rows_;
  Eigen::Vector3d center_;
  Eigen::Matrix3d world_from_cam_;
  Rendering out_;
  std::vector<std::vector<std::uint32_t>> holes_;  // pixels, by tile
};

}  // namespace lumihull::slf
