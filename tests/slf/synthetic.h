#pragma once

// Objects of known shape and colour, and photographs of them, for the tests of libslf.

#include <lumihull/base/camera.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/slf/photos.h>

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "ball.h"

namespace lumihull::test {

/// 8-bit sRGB colour of a place on the surface.
using Paint = std::function<Eigen::Vector3f(const Eigen::Vector3f&)>;

/// Smooth bands of colour; every channel between 40 and 215.
Paint bands();
Paint plain(int r, int g, int b);

/// Axis-parallel box, two triangles a face.
hull::Mesh box(const Eigen::Vector3f& low, const Eigen::Vector3f& high);
hull::Mesh merged(const hull::Mesh& a, const hull::Mesh& b);

Camera camera(int width, int height, double f);
/// Cameras around the origin at a distance, `rings` of them at several heights, looking at it; z is up.
std::vector<View> around(int per_ring, int rings, double distance, const Camera& camera);

/// What a camera sees of a painted mesh, 4 x 4 rays a pixel; background: bright green with alpha 0.
slf::Photo photograph(const hull::Mesh& mesh, const Paint& paint, const View& view);
/// All of them, taken at once and kept.
slf::PhotoSet photographs(const hull::Mesh& mesh, const Paint& paint, const std::vector<View>& views);

/// An edge_alpha for them: their rims are mixed with green; without them a plain object is plain to its edge.
inline constexpr double kNoTrace = 0.98;

/// Largest difference to a colour over the pixels that are covered at all; fails the test where they are few.
int largest_difference(const Image& rgba, const std::array<int, 3>& color);

}  // namespace lumihull::test
