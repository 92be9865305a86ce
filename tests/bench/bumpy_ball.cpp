#include "bumpy_ball.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>

#include "ball.h"

namespace lumihull::bench {

double seconds(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double fastest(int times, const std::function<void()>& body) {
  double best = seconds(body);
  for (int i = 1; i < times; ++i) best = std::min(best, seconds(body));
  return best;
}

hull::Mesh bumpy_ball(int steps) {
  hull::Mesh mesh = test::sphere(steps);
  for (Eigen::Vector3f& v : mesh.vertices) {
    const double polar = std::acos(std::clamp(double(v.z()), -1.0, 1.0)), azimuth = std::atan2(v.y(), v.x());
    v *= float(1 + 0.05 * std::sin(9 * azimuth) * std::sin(polar) * std::sin(7 * polar));
  }
  return mesh;
}

std::vector<Eigen::Vector3d> spiral(int count, double highest) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = highest - 2 * highest * (i + 0.5) / count, turn = i * 2.399963, r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return directions;
}

slf::Photo photograph(const hull::RayScene& scene, const View& view, const Paint& paint) {
  const Camera& c = view.camera;
  slf::Photo photo{Image(c.width, c.height, 3), Image(c.width, c.height, 1)};
  const Eigen::Vector3f eye = view.center().cast<float>();
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.conjugate().toRotationMatrix();
  std::vector<hull::Ray> rays;
  std::vector<hull::Hit> hits(std::size_t(c.width));
  for (int y = 0; y < c.height; ++y) {
    rays.clear();
    for (int x = 0; x < c.width; ++x) rays.push_back({eye, (rotation * *c.ray({x + 0.5, y + 0.5})).cast<float>()});
    scene.hit(rays, hits);
    for (int x = 0; x < c.width; ++x) {
      if (!hits[std::size_t(x)]) continue;
      const Eigen::Vector3f place = eye + hits[std::size_t(x)].t * rays[std::size_t(x)].direction;
      photo.alpha.row<std::uint8_t>(y)[x] = 255;
      for (int k = 0; k < 3; ++k) photo.rgb.row<std::uint8_t>(y)[3 * x + k] = std::uint8_t(paint(place, k));
    }
  }
  return photo;
}

slf::PhotoSet photographs(const hull::RayScene& scene, const Camera& camera, int count, double highest,
                          const Paint& paint) {
  slf::PhotoSet photos;
  for (const Eigen::Vector3d& direction : spiral(count, highest)) {
    photos.names.push_back(std::to_string(photos.names.size()));
    photos.views.push_back({camera, look_at(4 * direction, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ())});
  }
  photos.read = [&scene, views = photos.views, paint](std::size_t i) { return photograph(scene, views[i], paint); };
  return photos;
}

}  // namespace lumihull::bench
