#pragma once

#include <lumihull/base/camera.h>
#include <lumihull/rig/scene.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace lumihull::rig {

/// Where an object mirrors a lamp's centre to a camera.
struct Highlight {
  int lamp = 0;                     ///< index into Scene::lamps
  int object = 0;                   ///< index into Scene::objects
  Eigen::Vector3d point{0, 0, 0};   ///< on the object's mesh, m
  Eigen::Vector3d normal{0, 0, 1};  ///< there, of unit length
  Eigen::Vector2d pixel{0, 0};      ///< in the picture
  double depth = 0;                 ///< z in the camera's frame, m
  double strength = 0;              ///< luminance (Rec. 709) of the lamp's gloss there; 1: white at exposure 1
};

/// The truth about highlights. A mirror point is where the surface's normal halves the angle between the ways to eye
/// and lamp; normals are those that photographs are shaded with: the object's own, linear within a triangle. On a
/// convex object there is at most one for each lamp: it is where the smallest ellipsoid with foci in eye and lamp
/// touches the object (Fermat's principle), and two strictly convex bodies touch in one point. On others there may be
/// any number. Immutable after construction: any number of threads may ask.
class HighlightFinder {
 public:
  /// Errors: invalid_argument (a room without extent), bad_input (an object's mesh).
  explicit HighlightFinder(const Scene& scene);
  HighlightFinder(HighlightFinder&&) noexcept;
  ~HighlightFinder();

  /// Whether any object is glossy at all.
  bool any() const;
  /// All mirror points within the picture that the camera sees and their lamp's centre shines on; by lamp, then by
  /// strength, the strongest first. Objects that are matt or unlit have none.
  std::vector<Highlight> find(const View& view) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumihull::rig
