#pragma once

// What the benchmarks of appearance have in common: a bumpy ball, photographs of it, and a clock.

#include <lumihull/base/camera.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/photos.h>

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace lumihull::bench {

double seconds(const std::function<void()>& body);
/// The least of so many times, s.
double fastest(int times, const std::function<void()>& body);

/// Radius 1 and a little, around the origin; 4 steps² triangles or so.
hull::Mesh bumpy_ball(int steps);

/// Directions along a spiral over the sphere, from z = highest to -highest: unit vectors.
std::vector<Eigen::Vector3d> spiral(int count, double highest);

/// Photographs of the origin from 4 away, along a spiral; `scene` is to outlive them. A pixel's colour, 0 … 255, is
/// that of the place which one ray hits; they are made anew each time that they are read.
using Paint = std::function<float(const Eigen::Vector3f& place, int channel)>;
slf::PhotoSet photographs(const hull::RayScene& scene, const Camera& camera, int count, double highest,
                          const Paint& paint);
slf::Photo photograph(const hull::RayScene& scene, const View& view, const Paint& paint);

}  // namespace lumihull::bench
