// New views from a mesh of 20,000 triangles: bare, with a texture, from a light field of six terms; every pixel with
// 1 ray, 2 x 2 and 3 x 3, and adaptively. Synthetic: a bumpy ball that fills most of the picture's height, maps of
// made-up content (the time does not depend on it). The peer is Embree alone, which traces the same 1, 2 x 2 or 3 x 3
// rays in packets from directions that stand ready, on as many threads: less is not possible with rays.
//
//     bench_render [width = 1280] [height = 720]

#include <embree3/rtcore.h>
#include <lumihull/base/files.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/light_field.h>
#include <lumihull/slf/metrics.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/textured_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>

#include "bumpy_ball.h"

using namespace lumihull;

namespace {

/// A light field over a textured mesh: its texture shifted about for surface maps, waves over the nodes for view maps.
slf::LightField light_field(const slf::TexturedMesh& base, int terms, int nodes, double distance) {
  slf::LightField field;
  field.base = base;
  for (const Eigen::Vector3d& direction : bench::spiral(nodes, 0.98))
    field.nodes.push_back((distance * direction).cast<float>());
  const std::size_t vertices = base.mesh.vertices.size();
  for (int k = 0; k < terms; ++k) {
    slf::LightFieldTerm term;
    term.surface_scale = {0.8f, -0.4f}, term.view_scale = {1, -0.5f};
    Image map = base.texture;
    for (int y = 0; y < map.height(); ++y)
      std::copy_n(base.texture.row<std::uint8_t>((y + 3 * k) % map.height()), 3 * map.width(),
                  map.row<std::uint8_t>(y));
    term.surface.push_back(map);
    for (int i = 0; i < nodes; ++i)
      for (std::size_t v = 0; v < vertices; ++v)
        term.view.push_back(
            std::uint8_t(127.5f + 100 * std::sin(base.mesh.vertices[v].dot(field.nodes[std::size_t(i)]) + float(k))));
    field.terms.push_back(std::move(term));
  }
  return field;
}

/// Embree by itself.
class Peer {
 public:
  Peer(const hull::Mesh& mesh, const View& view, int n) {
    device_ = rtcNewDevice(nullptr);
    scene_ = rtcNewScene(device_);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    std::memcpy(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertices.size()),
        mesh.vertices.data(), 12 * mesh.vertices.size());
    std::memcpy(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()),
        mesh.triangles.data(), 12 * mesh.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
    wide_ = rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    const Eigen::Vector3f eye = view.center().cast<float>();
    const Eigen::Matrix3d rotation = view.cam_from_world.rotation.conjugate().toRotationMatrix();
    // Squares of 4 x 4 rays.
    const int w = view.camera.width * n, h = view.camera.height * n;
    for (int y = 0; y + 4 <= h; y += 4)
      for (int x = 0; x + 4 <= w; x += 4)
        for (int k = 0; k < 16; ++k) {
          const Eigen::Vector3f d =
              (rotation * *view.camera.ray({(x + k % 4 + 0.5) / n, (y + k / 4 + 0.5) / n})).cast<float>();
          for (int c = 0; c < 3; ++c) directions_.push_back(d[c]);
        }
    for (int c = 0; c < 3; ++c) eye_[c] = eye[c];
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { rtcReleaseScene(scene_), rtcReleaseDevice(device_); }

  void trace(Job& job) const {
    parallel_chunks(job, directions_.size() / 3, 16 * 1024, [&](std::size_t first, std::size_t last) {
      wide_ ? packets<RTCRayHit16, 16>(first, last) : packets<RTCRayHit8, 8>(first, last);
    });
  }

 private:
  template <class Packet, std::size_t kLanes>
  void packets(std::size_t first, std::size_t last) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    alignas(64) Packet p{};
    alignas(64) int valid[kLanes];
    std::fill_n(valid, kLanes, -1);
    std::fill_n(p.ray.org_x, kLanes, eye_[0]), std::fill_n(p.ray.org_y, kLanes, eye_[1]);
    std::fill_n(p.ray.org_z, kLanes, eye_[2]), std::fill_n(p.ray.mask, kLanes, ~0u);
    for (std::size_t i = first; i < last; i += kLanes) {
      for (std::size_t k = 0; k < kLanes; ++k) {
        p.ray.dir_x[k] = directions_[3 * (i + k)], p.ray.dir_y[k] = directions_[3 * (i + k) + 1];
        p.ray.dir_z[k] = directions_[3 * (i + k) + 2];
      }
      std::fill_n(p.ray.tfar, kLanes, std::numeric_limits<float>::infinity());
      std::fill_n(p.hit.geomID, kLanes, RTC_INVALID_GEOMETRY_ID);
      if constexpr (kLanes == 16)
        rtcIntersect16(valid, scene_, &context, &p);
      else
        rtcIntersect8(valid, scene_, &context, &p);
    }
  }

  RTCDevice device_;
  RTCScene scene_;
  bool wide_;
  float eye_[3];
  std::vector<float> directions_;
};

}  // namespace

int main(int argc, char** argv) {
  const int width = argc > 1 ? std::atoi(argv[1]) : 1280, height = argc > 2 ? std::atoi(argv[2]) : 720;
  if (width < 16 || height < 16 || width > 8192 || height > 8192) return std::fprintf(stderr, "bad arguments\n"), 2;

  Job job;
  const hull::Mesh mesh = bench::bumpy_ball(71);
  const hull::RayScene scene(mesh);
  Camera camera;
  camera.width = 960, camera.height = 960, camera.f = 1700, camera.u0 = camera.v0 = 480;
  const slf::PhotoSet photos = bench::photographs(scene, camera, 16, 0.9, [](const Eigen::Vector3f& p, int k) {
    return 127.5f + 60 * std::sin(20 * p[k] + 5 * p[(k + 1) % 3]) + 40 * std::sin(90 * p[(k + 2) % 3]);
  });
  slf::TextureOptions options;
  options.texel_px = 1.75;
  const slf::TexturedMesh textured = slf::mean_texture(mesh, photos, options, job);
  reset_peak_memory();
  const slf::LightFieldRenderer field(light_field(textured, 6, 96, 4));
  std::printf("%zu triangles, texture %d x %d, 6 terms, 96 nodes, %u threads; peak of making it %.0f MB\n",
              mesh.triangles.size(), textured.texture.width(), textured.texture.height(), job.threads(),
              double(peak_memory_bytes()) / 1e6);

  View view = photos.views[0];
  view.camera.width = width, view.camera.height = height, view.camera.f = 1.8 * height;
  view.camera.u0 = 0.5 * width, view.camera.v0 = 0.5 * height;
  view.cam_from_world = look_at({2.8, 2.4, 1.5}, {0, 0, 0}, {0, 0, 1});
  View bent = view;
  bent.camera.k1 = 0.1, bent.camera.k2 = -0.03, bent.camera.p1 = 0.001;

  const auto flat = [](const slf::Rendering& r) { return slf::composited(r.rgba, {0, 0, 0}); };
  const std::function<slf::Rendering(const slf::RenderOptions&)> methods[] = {
      [&](const slf::RenderOptions& o) { return slf::render_shaded(mesh, scene, view, o, job); },
      [&](const slf::RenderOptions& o) { return slf::render_texture(textured, scene, view, o, job); },
      [&](const slf::RenderOptions& o) { return field.render(view, o, job); },
      [&](const slf::RenderOptions& o) { return field.render(bent, o, job); }};
  std::vector<slf::Rendering> best;
  for (const auto& method : methods) best.push_back(method({8, false}));
  std::size_t covered = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) covered += best[2].rgba.row<std::uint8_t>(y)[4 * x + 3] > 0;
  std::printf("%d x %d, object in %.0f %% of the pixels; frames/s (dB against 8 x 8 rays); the last with distortion\n",
              width, height, 100.0 * double(covered) / (double(width) * height));
  std::printf("%-20s %8s %18s %18s %18s %18s %9s\n", "", "Embree", "shaded", "texture", "light field", "through a lens",
              "peak MB");
  for (const slf::RenderOptions& o :
       {slf::RenderOptions{1, false}, slf::RenderOptions{2, false}, slf::RenderOptions{3, false},
        slf::RenderOptions{2, false, true}, slf::RenderOptions{3, false, true}, slf::RenderOptions{4, false, true}}) {
    double embree;
    {
      const Peer peer(mesh, view, o.rays);
      embree = bench::fastest(10, [&] { peer.trace(job); });
    }
    reset_peak_memory();
    std::printf("%d x %d %-14s %8.1f", o.rays, o.rays, o.adaptive ? "adaptive" : "", 1 / embree);
    for (std::size_t m = 0; m < 4; ++m) {
      slf::Rendering r;
      const double time = bench::fastest(10, [&] { r = methods[m](o); });
      std::printf("   %7.1f (%4.1f)", 1 / time, slf::psnr(flat(r), flat(best[m])));
    }
    std::printf(" %10.0f\n", double(peak_memory_bytes()) / 1e6);
  }
}
