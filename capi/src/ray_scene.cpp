#include <lumihull/base/parallel.h>
#include <lumihull/hull/ray_scene.h>

#include <limits>
#include <vector>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;
using hull::Hit;
using hull::Ray;

static_assert(LH_NO_HIT == hull::kNoHit);

namespace {

constexpr size_t kChunk = 4096;  ///< rays handed over at once

/// Whether Embree can walk along it: what is not finite hits nothing.
bool castable(const Ray& ray) {
  return ray.origin.allFinite() && ray.direction.allFinite() && !ray.direction.isZero(0);
}

Eigen::Vector3f vector(const float* xyz, size_t i) { return Eigen::Map<const Eigen::Vector3f>(xyz + 3 * i); }

}  // namespace

lh_status lh_ray_scene_create(lh_context* ctx, const lh_mesh* mesh, lh_ray_scene** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, hull::RayScene(given(mesh, "mesh").value));
  });
}

void lh_ray_scene_destroy(lh_ray_scene* scene) { delete scene; }

lh_status lh_ray_scene_hit(lh_context* ctx, const lh_ray_scene* scene, const float* origins, const float* directions,
                           size_t n, uint32_t* triangle, float* distance, float* barycentric) {
  return guarded(ctx, [&](Job& job) {
    const hull::RayScene& s = given(scene, "scene").value;
    array(origins, n, 3, "origins");
    array(directions, n, 3, "directions");
    array(triangle, n, 1, "triangle");
    parallel_chunks(job, n, kChunk, [&](size_t first, size_t last) {
      std::vector<Ray> rays(last - first);
      std::vector<Hit> hits(last - first);
      for (size_t i = first; i < last; ++i) {
        Ray& ray = rays[i - first] = {vector(origins, i), vector(directions, i)};
        if (!castable(ray)) ray = {Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitX(), 0, 0};
      }
      s.hit(rays, hits);
      for (size_t i = first; i < last; ++i) {
        Hit hit = hits[i - first];
        if (!hit || rays[i - first].t_far == 0) hit = {hull::kNoHit, std::numeric_limits<float>::infinity(), 0, 0};
        triangle[i] = hit.triangle;
        if (distance) distance[i] = hit.t;
        if (barycentric) barycentric[2 * i] = hit.b1, barycentric[2 * i + 1] = hit.b2;
      }
    });
  });
}

lh_status lh_ray_scene_occluded(lh_context* ctx, const lh_ray_scene* scene, const float* a, const float* b, size_t n,
                                float margin, uint8_t* occluded) {
  return guarded(ctx, [&](Job& job) {
    const hull::RayScene& s = given(scene, "scene").value;
    array(a, n, 3, "a");
    array(b, n, 3, "b");
    array(occluded, n, 1, "occluded");
    if (!(margin >= 0 && margin < 0.5f))
      invalid("expected 0 <= margin < 0.5, found " + std::to_string(margin), "margin");
    parallel_chunks(job, n, kChunk, [&](size_t first, size_t last) {
      std::vector<Ray> rays(last - first);
      for (size_t i = first; i < last; ++i) {
        Ray& ray = rays[i - first] = {vector(a, i), vector(b, i) - vector(a, i), margin, 1 - margin};
        if (!castable(ray)) ray = {Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitX(), 0, 0};
      }
      std::vector<uint8_t> hidden(last - first);
      s.occluded(rays, hidden);
      for (size_t i = first; i < last; ++i) occluded[i] = rays[i - first].t_far > 0 && hidden[i - first] ? 1 : 0;
    });
  });
}
