#include <embree3/rtcore.h>
#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/hull/simplify.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>

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
  validate(to, "mesh");
  if (from.empty() || to.empty()) throw Error(ErrorCode::invalid_argument, "an empty mesh has no distance");
  const std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
  if (!device) throw Error(ErrorCode::internal, "Embree does not start on this machine");
  const std::unique_ptr<RTCSceneTy, void (*)(RTCScene)> scene(rtcNewScene(device.get()), rtcReleaseScene);
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  const std::unique_ptr<RTCGeometryTy, void (*)(RTCGeometry)> geometry(
      rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE), rtcReleaseGeometry);
  void* vertices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), to.vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(std::uint32_t), to.triangles.size());
  if (!vertices || !indices) throw Error(ErrorCode::out_of_memory, "no memory for the mesh's tree");
  std::copy_n(to.vertices[0].data(), 3 * to.vertices.size(), static_cast<float*>(vertices));
  std::copy_n(to.triangles[0].data(), 3 * to.triangles.size(), static_cast<std::uint32_t*>(indices));
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene.get(), geometry.get());
  rtcCommitScene(scene.get());

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
