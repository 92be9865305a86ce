#include <lumihull/base/parallel.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/hull/simplify.h>
#include <lumihull/hull/surface_distance.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "embree_scene.h"

namespace lumihull::hull {
namespace {

/// The point of a triangle that is nearest to p (Ericson, Real-Time Collision Detection, 5.1.5: by Voronoi regions).
Eigen::Vector3f nearest(const Eigen::Vector3f& p, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                        const Eigen::Vector3f& c) {
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const Eigen::Vector3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float sum = va + vb + vc;
  return sum != 0 ? Eigen::Vector3f(a + vb / sum * ab + vc / sum * ac) : a;
}

bool visit(RTCPointQueryFunctionArguments* args) {
  const Mesh& mesh = *static_cast<const Mesh*>(args->userPtr);
  const auto& t = mesh.triangles[args->primID];
  const Eigen::Vector3f p(args->query->x, args->query->y, args->query->z);
  const float d = (nearest(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) - p).norm();
  if (!(d < args->query->radius)) return false;
  args->query->radius = d;
  return true;
}

float distance_to(const EmbreeScene& scene, const Mesh& mesh, const Eigen::Vector3f& p) {
  RTCPointQuery query{p.x(), p.y(), p.z(), 0, std::numeric_limits<float>::infinity()};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene.get(), &query, &context, visit, const_cast<Mesh*>(&mesh));
  return query.radius;
}

}  // namespace

MeshDistance distance(const Mesh& from, const Mesh& to, Job& job) {
  validate(from, "mesh");
  if (from.empty() || to.empty()) throw Error(ErrorCode::invalid_argument, "an empty mesh has no distance");
  const EmbreeScene scene(to);
  const std::size_t n = from.vertices.size() + from.triangles.size(), chunk = 4096;
  std::vector<MeshDistance> parts((n + chunk - 1) / chunk);
  parallel_chunks(job, n, chunk, [&](std::size_t first, std::size_t last) {
    MeshDistance& part = parts[first / chunk];
    for (std::size_t i = first; i < last; ++i) {
      Eigen::Vector3f p;
      if (i < from.vertices.size()) {
        p = from.vertices[i];
      } else {
        const auto& t = from.triangles[i - from.vertices.size()];
        p = (from.vertices[t[0]] + from.vertices[t[1]] + from.vertices[t[2]]) / 3;
      }
      const double d = distance_to(scene, to, p);
      part.max = std::max(part.max, d);
      part.rms += d * d;
    }
  });
  MeshDistance sum;
  for (const MeshDistance& part : parts) sum = {std::max(sum.max, part.max), sum.rms + part.rms};
  sum.rms = std::sqrt(sum.rms / double(n));
  return sum;
}

struct SurfaceDistance::Impl {
  explicit Impl(const Mesh& m) : mesh(m), scene(m), rays(m) {}
  Mesh mesh;
  EmbreeScene scene;
  RayScene rays;
};

SurfaceDistance::SurfaceDistance(const Mesh& mesh) {
  validate(mesh, "mesh");
  if (mesh.empty()) throw Error(ErrorCode::invalid_argument, "an empty mesh has no distance");
  impl_ = std::make_unique<Impl>(mesh);
}
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;
SurfaceDistance::~SurfaceDistance() = default;

float SurfaceDistance::operator()(const Eigen::Vector3f& p) const { return distance_to(impl_->scene, impl_->mesh, p); }

bool SurfaceDistance::encloses(const Eigen::Vector3f& p) const {
  // Directions that no grid and no symmetric object has edges along.
  static const Eigen::Vector3f directions[3] = {
      {0.8131f, 0.3757f, 0.4446f}, {-0.4279f, 0.8703f, -0.2441f}, {-0.1723f, -0.5219f, 0.8354f}};
  int votes = 0;
  for (const Eigen::Vector3f& d : directions) {
    bool odd = false;
    Ray ray{p, d};
    for (Hit hit = impl_->rays.hit(ray); hit; hit = impl_->rays.hit(ray)) {
      odd = !odd;
      ray.t_near = std::nextafter(hit.t, std::numeric_limits<float>::infinity());
    }
    votes += odd;
  }
  return votes >= 2;
}

std::vector<Eigen::Vector3f> surface_points(const Mesh& mesh, std::size_t count) {
  validate(mesh, "mesh");
  const auto area = [&](const std::array<std::uint32_t, 3>& t) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    return 0.5 * (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a).norm();
  };
  double total = 0;
  for (const auto& t : mesh.triangles) total += area(t);
  if (!(total > 0)) throw Error(ErrorCode::invalid_argument, "a mesh without area has no points");
  std::vector<Eigen::Vector3f> points;
  points.reserve(count);
  double passed = 0;
  for (const auto& t : mesh.triangles) {
    passed += area(t);
    while (points.size() < count && (double(points.size()) + 0.5) / double(count) * total <= passed) {
      // Where in the triangle: a two-dimensional additive sequence (plastic number), folded into it.
      const double i = double(points.size());
      double u = std::fmod(0.5 + i * 0.7548776662466927, 1.0), v = std::fmod(0.5 + i * 0.5698402909980532, 1.0);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      points.push_back(float(1 - u - v) * mesh.vertices[t[0]] + float(u) * mesh.vertices[t[1]] +
                       float(v) * mesh.vertices[t[2]]);
    }
  }
  while (points.size() < count) points.push_back(mesh.vertices[mesh.triangles.back()[0]]);  // rounding of the sum
  return points;
}

}  // namespace lumihull::hull
