#pragma once

#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/lumigraph.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::slf {

/// A place on the surface that a new view looks at.
struct SurfacePoint {
  Eigen::Vector3f position, normal;  // normal: unit length
  float spacing = 0;                 // world size of the new view's pixel there
};

/// How a photograph takes part at a surface point. The pixel moves with the point by `jacobian`, so that the rays of
/// one pixel share one projection.
struct BlendSource {
  std::uint32_t point;  // index into the points asked about
  std::uint32_t photo;
  float weight;
  Eigen::Vector2f pixel;
  Eigen::Matrix<float, 2, 3> jacobian;  // d pixel / d world point
};

/// Chooses and weighs the photographs to blend (see Lumigraph). Immutable; any number of threads may ask.
class SourceRanking {
 public:
  SourceRanking(const hull::RayScene& scene, float offset, const PhotoSet& photos, const LumigraphOptions& options);

  /// The photographs for each of some neighbouring points, seen from `eye`; ordered by photograph, then point.
  std::vector<BlendSource> rank(std::span<const SurfacePoint> points, const Eigen::Vector3f& eye) const;

 private:
  struct Source {
    View view;
    Eigen::Vector3f center;
    float focal;  // geometric mean of both focal lengths, px
  };
  struct Candidate;

  std::vector<std::uint32_t> nearest_sources(std::span<const SurfacePoint> points, const Eigen::Vector3f& eye) const;
  float penalty(const SurfacePoint& point, const Eigen::Vector3f& to_eye, const Source& source) const;
  bool project(const SurfacePoint& point, const Source& source, BlendSource& out) const;

  const hull::RayScene& scene_;
  float offset_;
  LumigraphOptions options_;
  std::vector<Source> sources_;
};

}  // namespace lumihull::slf
