#include <embree3/rtcore.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/ray_scene.h>

#include <algorithm>
#include <cassert>
#include <cstring>

namespace lumihull::hull {

struct RayScene::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  void check(const char* doing) const {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    throw Error(error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::internal,
                std::string("Embree failed ") + doing + " (error " + std::to_string(int(error)) + ")");
  }
};

namespace {

constexpr int kPacket = 8;

RTCIntersectContext context(RTCIntersectContextFlags flags) {
  RTCIntersectContext c;
  rtcInitIntersectContext(&c);
  c.flags = flags;
  return c;
}

/// Fills a packet from up to eight rays; lanes beyond are switched off by `valid`.
template <class Packet>
void load(std::span<const Ray> rays, Packet& packet, int* valid) {
  for (std::size_t i = 0; i < kPacket; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    valid[i] = i < rays.size() ? -1 : 0;
    packet.org_x[i] = ray.origin.x();
    packet.org_y[i] = ray.origin.y();
    packet.org_z[i] = ray.origin.z();
    packet.dir_x[i] = ray.direction.x();
    packet.dir_y[i] = ray.direction.y();
    packet.dir_z[i] = ray.direction.z();
    packet.tnear[i] = ray.t_near;
    packet.tfar[i] = ray.t_far;
    packet.time[i] = 0;
    packet.mask[i] = ~0u;
    packet.id[i] = unsigned(i);
    packet.flags[i] = 0;
  }
}

void load(const Ray& ray, RTCRay& r) {
  r = {};
  r.org_x = ray.origin.x();
  r.org_y = ray.origin.y();
  r.org_z = ray.origin.z();
  r.dir_x = ray.direction.x();
  r.dir_y = ray.direction.y();
  r.dir_z = ray.direction.z();
  r.tnear = ray.t_near;
  r.tfar = ray.t_far;
  r.mask = ~0u;
}

}  // namespace

RayScene::RayScene(const Mesh& mesh) : impl_(std::make_unique<Impl>()) {
  validate(mesh, "mesh");
  impl_->device = rtcNewDevice(nullptr);
  if (!impl_->device) throw Error(ErrorCode::internal, "Embree does not start on this machine");
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_MEDIUM);
  if (!mesh.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             sizeof(Eigen::Vector3f), mesh.vertices.size());
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.triangles.size());
    if (vertices && indices) {
      std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
      std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(std::uint32_t));
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(impl_->scene, geometry, 0);
    }
    rtcReleaseGeometry(geometry);
    impl_->check("to store the mesh");
  }
  rtcCommitScene(impl_->scene);
  impl_->check("to build its tree");
}

RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

Hit RayScene::hit(const Ray& ray) const {
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(16) RTCRayHit query;
  load(ray, query.ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &c, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

bool RayScene::occluded(const Ray& ray) const {
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(16) RTCRay query;
  load(ray, query);
  rtcOccluded1(impl_->scene, &c, &query);
  return query.tfar < 0;
}

void RayScene::hit(std::span<const Ray> rays, std::span<Hit> out) const {
  assert(rays.size() == out.size());
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  alignas(32) RTCRayHit8 packet;
  alignas(32) int valid[kPacket];
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const std::size_t n = std::min<std::size_t>(kPacket, rays.size() - first);
    load(rays.subspan(first, n), packet.ray, valid);
    std::fill_n(packet.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(packet.hit.instID[0], kPacket, RTC_INVALID_GEOMETRY_ID);
    rtcIntersect8(valid, impl_->scene, &c, &packet);
    for (std::size_t i = 0; i < n; ++i)
      out[first + i] = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
                           ? Hit{}
                           : Hit{packet.hit.primID[i], packet.ray.tfar[i], packet.hit.u[i], packet.hit.v[i]};
  }
}

void RayScene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> out) const {
  assert(rays.size() == out.size());
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  alignas(32) RTCRay8 packet;
  alignas(32) int valid[kPacket];
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const std::size_t n = std::min<std::size_t>(kPacket, rays.size() - first);
    load(rays.subspan(first, n), packet, valid);
    rtcOccluded8(valid, impl_->scene, &c, &packet);
    for (std::size_t i = 0; i < n; ++i) out[first + i] = packet.tfar[i] < 0;
  }
}

}  // namespace lumihull::hull
