#pragma once

// Silhouettes of analytic objects with exact truth: masks are area coverage, so that contours are sub-pixel.

#include <lumihull/base/camera.h>
#include <lumihull/base/image.h>
#include <lumihull/hull/silhouette.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace lumihull::test {

/// Whether the ray origin + t direction, t > 0, meets the object.
using Shape = std::function<bool(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;

Shape sphere(const Eigen::Vector3d& center, double radius);
Shape box(const Eigen::Vector3d& center, const Eigen::Vector3d& half);
Shape capsule(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Around the z axis through the origin.
Shape torus(double major, double minor);
Shape either(std::vector<Shape> shapes);

/// 8-bit coverage: exact where a pixel's corners agree, else 16 x 16 samples.
Image mask_of(const Shape& shape, const View& view);

Camera pinhole(int width, int height, double f);

/// n views from a spiral on a sphere around `target` (the whole sphere, or its upper half).
std::vector<View> views_around(const Camera& camera, int n, double distance, bool hemisphere = false,
                               const Eigen::Vector3d& target = Eigen::Vector3d::Zero());

std::vector<hull::Silhouette> silhouettes_of(const Shape& shape, const std::vector<View>& views,
                                             const hull::SilhouetteOptions& options = {});

}  // namespace lumihull::test
