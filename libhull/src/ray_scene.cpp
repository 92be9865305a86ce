#include <lumihull/hull/ray_scene.h>

#include <algorithm>
#include <cassert>

#include "embree_scene.h"

namespace lumihull::hull {

struct RayScene::Impl {
  explicit Impl(const Mesh& mesh) : scene(mesh) {}
  EmbreeScene scene;
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

RayScene::RayScene(const Mesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

Hit RayScene::hit(const Ray& ray) const {
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(16) RTCRayHit query;
  load(ray, query.ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene.get(), &c, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

bool RayScene::occluded(const Ray& ray) const {
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(16) RTCRay query;
  load(ray, query);
  rtcOccluded1(impl_->scene.get(), &c, &query);
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
    rtcIntersect8(valid, impl_->scene.get(), &c, &packet);
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
    rtcOccluded8(valid, impl_->scene.get(), &c, &packet);
    for (std::size_t i = 0; i < n; ++i) out[first + i] = packet.tfar[i] < 0;
  }
}

}  // namespace lumihull::hull
