#include <lumihull/base/parallel.h>
#include <lumihull/hull/simplify.h>

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
      RTCPointQuery query{p.x(), p.y(), p.z(), 0, std::numeric_limits<float>::infinity()};
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      rtcPointQuery(scene.get(), &query, &context, visit, const_cast<Mesh*>(&to));
      part.max = std::max(part.max, double(query.radius));
      part.rms += double(query.radius) * double(query.radius);
    }
  });
  MeshDistance sum;
  for (const MeshDistance& part : parts) sum = {std::max(sum.max, part.max), sum.rms + part.rms};
  sum.rms = std::sqrt(sum.rms / double(n));
  return sum;
}

}  // namespace lumihull::hull
