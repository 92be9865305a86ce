#include <lumihull/hull/ray_scene.h>

#include <algorithm>
#include <cassert>

#include "embree_scene.h"

namespace lumihull::hull {

struct RayScene::Impl {
  explicit Impl(const Mesh& mesh) : scene(mesh), wide(scene.takes_16_rays()) {}
  EmbreeScene scene;
  bool wide;
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

void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit8* packet) {
  rtcIntersect8(valid, scene, context, packet);
}

void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* packet) {
  rtcIntersect16(valid, scene, context, packet);
}

/// Rays from one point, as many at a time as a packet has lanes.
template <class Packet, std::size_t kLanes>
void hit_from(RTCScene scene, const Eigen::Vector3f& origin, const Directions& d, std::span<Hit> out) {
  RTCIntersectContext c = context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  alignas(64) Packet packet;
  alignas(64) int valid[kLanes];
  std::fill_n(packet.ray.org_x, kLanes, origin.x());
  std::fill_n(packet.ray.org_y, kLanes, origin.y());
  std::fill_n(packet.ray.org_z, kLanes, origin.z());
  std::fill_n(packet.ray.tnear, kLanes, 0.0f);
  std::fill_n(packet.ray.time, kLanes, 0.0f);
  std::fill_n(packet.ray.mask, kLanes, ~0u);
  std::fill_n(packet.ray.flags, kLanes, 0u);
  for (unsigned i = 0; i < kLanes; ++i) packet.ray.id[i] = i;
  for (std::size_t first = 0; first < out.size(); first += kLanes) {
    const std::size_t n = std::min(kLanes, out.size() - first);
    std::copy_n(d.x.data() + first, n, packet.ray.dir_x);
    std::copy_n(d.y.data() + first, n, packet.ray.dir_y);
    std::copy_n(d.z.data() + first, n, packet.ray.dir_z);
    for (std::size_t i = n; i < kLanes; ++i) packet.ray.dir_x[i] = packet.ray.dir_y[i] = packet.ray.dir_z[i] = 1;
    for (std::size_t i = 0; i < kLanes; ++i) {
      // What is not finite times 0 is not 0.
      const float sum = 0 * packet.ray.dir_x[i] + 0 * packet.ray.dir_y[i] + 0 * packet.ray.dir_z[i];
      valid[i] = sum == 0 && i < n ? -1 : 0;
    }
    std::fill_n(packet.ray.tfar, kLanes, std::numeric_limits<float>::infinity());
    std::fill_n(packet.hit.geomID, kLanes, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(packet.hit.instID[0], kLanes, RTC_INVALID_GEOMETRY_ID);
    intersect(valid, scene, &c, &packet);
    for (std::size_t i = 0; i < n; ++i)
      out[first + i] = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
                           ? Hit{}
                           : Hit{packet.hit.primID[i], packet.ray.tfar[i], packet.hit.u[i], packet.hit.v[i]};
  }
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

void RayScene::hit(const Eigen::Vector3f& origin, const Directions& directions, std::span<Hit> out) const {
  assert(directions.x.size() == out.size() && directions.y.size() == out.size() && directions.z.size() == out.size());
  if (impl_->wide)
    hit_from<RTCRayHit16, 16>(impl_->scene.get(), origin, directions, out);
  else
    hit_from<RTCRayHit8, 8>(impl_->scene.get(), origin, directions, out);
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
