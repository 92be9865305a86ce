#include "synthetic.h"

#include <gtest/gtest.h>
#include <lumihull/hull/ray_scene.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

namespace lumihull::test {

Paint bands() {
  return [](const Eigen::Vector3f& p) {
    const auto wave = [](float x) { return 127.5f + 87.5f * std::sin(x); };
    return Eigen::Vector3f(wave(3 * p.x() + 1), wave(3 * p.y() - 2 * p.z()), wave(4 * p.z() + p.x()));
  };
}

Paint plain(int r, int g, int b) {
  return [=](const Eigen::Vector3f&) { return Eigen::Vector3f(float(r), float(g), float(b)); };
}

hull::Mesh box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  hull::Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back({i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z()});
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

hull::Mesh merged(const hull::Mesh& a, const hull::Mesh& b) {
  hull::Mesh mesh = a;
  const auto shift = std::uint32_t(a.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  return mesh;
}

Camera camera(int width, int height, double f) {
  Camera c;
  c.width = width, c.height = height, c.f = f, c.u0 = 0.5 * width, c.v0 = 0.5 * height;
  return c;
}

std::vector<View> around(int per_ring, int rings, double distance, const Camera& camera) {
  std::vector<View> views;
  for (int r = 0; r < rings; ++r) {
    const double elevation = rings == 1 ? 0.3 : -1.1 + 2.2 * r / (rings - 1);
    for (int i = 0; i < per_ring; ++i) {
      const double azimuth = 2 * std::numbers::pi * (i + 0.5 * (r % 2)) / per_ring;
      const Eigen::Vector3d eye =
          distance * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                     std::sin(elevation));
      views.push_back({camera, look_at(eye, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ())});
    }
  }
  return views;
}

slf::Photo photograph(const hull::Mesh& mesh, const Paint& paint, const View& view) {
  const hull::RayScene scene(mesh);
  const int w = view.camera.width, h = view.camera.height, n = 4;
  slf::Photo photo{Image(w, h, 3), Image(w, h, 1)};
  const Eigen::Vector3f eye = view.center().cast<float>();
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      std::array<float, 3> sum{};
      int hits = 0;
      for (int k = 0; k < n * n; ++k) {
        const auto ray = view.camera.ray({x + (k % n + 0.5) / n, y + (k / n + 0.5) / n});
        const hull::Ray r{eye, (rotation * *ray).cast<float>()};
        const hull::Hit hit = scene.hit(r);
        const Eigen::Vector3f c = hit ? paint(r.origin + hit.t * r.direction) : Eigen::Vector3f(0, 255, 0);
        hits += hit.triangle != hull::kNoHit;
        for (int i = 0; i < 3; ++i) sum[i] += linear_from_srgb(c[i] / 255);
      }
      for (int i = 0; i < 3; ++i)
        photo.rgb.row<std::uint8_t>(y)[3 * x + i] = std::uint8_t(std::lround(255 * srgb_from_linear(sum[i] / (n * n))));
      photo.alpha.row<std::uint8_t>(y)[x] = std::uint8_t((hits * 255 + n * n / 2) / (n * n));
    }
  return photo;
}

slf::PhotoSet photographs(const hull::Mesh& mesh, const Paint& paint, const std::vector<View>& views) {
  auto kept = std::make_shared<std::vector<slf::Photo>>();
  slf::PhotoSet set;
  for (const View& view : views) {
    set.names.push_back("photo" + std::to_string(set.names.size()));
    kept->push_back(photograph(mesh, paint, view));
  }
  set.views = views;
  set.read = [kept](std::size_t i) { return kept->at(i); };
  return set;
}

int largest_difference(const Image& rgba, const std::array<int, 3>& color) {
  int worst = 0, covered = 0;
  for (int y = 0; y < rgba.height(); ++y)
    for (int x = 0; x < rgba.width(); ++x) {
      const std::uint8_t* p = rgba.row<std::uint8_t>(y) + 4 * x;
      if (p[3] == 0) continue;
      ++covered;
      for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(int(p[c]) - color[c]));
    }
  EXPECT_GT(covered, 100);
  return worst;
}

}  // namespace lumihull::test
