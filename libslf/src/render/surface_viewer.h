#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/photos.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "atlas/atlas.h"

namespace lumihull::slf {

/// Geometric mean of both focal lengths, px.
double focal_length(const Camera& camera);

/// World size of a pixel of the photograph that resolves a triangle best, median over the surface. At least one
/// photograph.
double finest_pixel(const hull::Mesh& mesh, const PhotoSet& photos);

/// World size of a pixel at the middle of the object, median over the photographs.
double ordinary_pixel(const hull::Mesh& mesh, const PhotoSet& photos);

/// A texel as a photograph sees it.
struct SeenTexel {
  std::uint32_t texel;
  float cosine;           // between the surface's normal and the way to the camera, > 0
  float distance;         // to the camera, world units
  Eigen::Vector2f pixel;  // in the photograph
  Eigen::Vector3f place;
};

/// Which texels of an atlas a camera sees, and where. Immutable.
class SurfaceViewer {
 public:
  /// What is given must outlive the object. shadow_offset: where shadow rays start, world units.
  SurfaceViewer(const hull::Mesh& mesh, const hull::RayScene& scene, const Atlas& atlas, float shadow_offset);

  /// Camera with what doesn't change from point to point. The lens is linearised over a block of texels (some pixels
  /// wide: the error is below a hundredth of a pixel); the perspective is exact.
  struct Projector {
    const Camera& camera;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    Eigen::Vector3f center;
    bool distorted;

    explicit Projector(const View& view);
  };

  struct Scratch {
    std::vector<hull::Ray> rays;
    std::vector<std::uint8_t> hidden;
  };

  /// The texels of a block that face the camera, lie in its picture, and that nothing hides, in order. Shadow rays are
  /// cast for nine texels spread over the block, and for every one where these disagree.
  void see(const Projector& projector, std::size_t block, std::vector<SeenTexel>& seen, Scratch& scratch) const;

 private:
  void candidates(const Projector& projector, std::size_t block, std::vector<SeenTexel>& seen) const;
  void remove_hidden(const Projector& projector, std::vector<SeenTexel>& seen, Scratch& scratch) const;

  const hull::Mesh& mesh_;
  const hull::RayScene& scene_;
  const Atlas& atlas_;
  float offset_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace lumihull::slf
