#include "surface_viewer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace lumihull::slf {
namespace {

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

double focal_length(const Camera& camera) { return camera.f * std::sqrt(camera.s); }

double finest_pixel(const hull::Mesh& mesh, const PhotoSet& photos) {
  std::vector<double> sizes;
  const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / 4000);
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    const Eigen::Vector3d n = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3;
    double best = std::numeric_limits<double>::infinity();
    for (const View& view : photos.views) {
      const Eigen::Vector3d away = view.center() - middle;
      const double distance = away.norm();
      if (!(away.dot(n) > 0.3 * distance)) continue;
      best = std::min(best, distance / focal_length(view.camera));
    }
    if (std::isfinite(best)) sizes.push_back(best);
  }
  if (sizes.empty()) {  // nothing is seen from the front: the size does not matter much
    for (const View& view : photos.views)
      sizes.push_back((view.center() - mesh.vertices[0].cast<double>()).norm() / focal_length(view.camera));
  }
  return std::max(median(sizes), 1e-30);
}

double ordinary_pixel(const hull::Mesh& mesh, const PhotoSet& photos) {
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  std::vector<double> sizes;
  for (const View& view : photos.views)
    sizes.push_back((view.center() - box.center().cast<double>()).norm() / focal_length(view.camera));
  return std::max(median(sizes), 1e-30);
}

SurfaceViewer::SurfaceViewer(const hull::Mesh& mesh, const hull::RayScene& scene, const Atlas& atlas,
                             float shadow_offset)
    : mesh_(mesh), scene_(scene), atlas_(atlas), offset_(shadow_offset), normals_(hull::vertex_normals(mesh)) {}

SurfaceViewer::Projector::Projector(const View& view)
    : camera(view.camera),
      rotation(view.cam_from_world.rotation.toRotationMatrix()),
      translation(view.cam_from_world.translation),
      center(view.center().cast<float>()),
      distorted(view.camera.has_distortion()) {}

void SurfaceViewer::see(const Projector& projector, std::size_t block, std::vector<SeenTexel>& seen,
                        Scratch& scratch) const {
  seen.clear();
  candidates(projector, block, seen);
  if (!seen.empty()) remove_hidden(projector, seen, scratch);
}

void SurfaceViewer::candidates(const Projector& projector, std::size_t block, std::vector<SeenTexel>& seen) const {
  struct LensPatch {
    Eigen::Vector2d corrected, distorted;
    Eigen::Matrix2d jacobian;
  };
  std::optional<LensPatch> patch;
  const Camera& camera = projector.camera;
  for (std::uint32_t i = atlas_.blocks[block]; i < atlas_.blocks[block + 1]; ++i) {
    const Texel& texel = atlas_.texels[i];
    const auto& t = mesh_.triangles[texel.triangle];
    const float b0 = 1 - texel.b1 - texel.b2;
    const Eigen::Vector3f place =
        b0 * mesh_.vertices[t[0]] + texel.b1 * mesh_.vertices[t[1]] + texel.b2 * mesh_.vertices[t[2]];
    const Eigen::Vector3f normal = b0 * normals_[t[0]] + texel.b1 * normals_[t[1]] + texel.b2 * normals_[t[2]];
    const Eigen::Vector3f away = projector.center - place;
    const float facing = away.dot(normal);
    if (!(facing > 0)) continue;
    const Eigen::Vector3d p = projector.rotation * place.cast<double>() + projector.translation;
    if (!(p.z() > 0)) continue;
    Eigen::Vector2d lens(p.x() / p.z(), p.y() / p.z());
    if (projector.distorted) {
      if (!patch) {
        LensPatch fresh{lens, {}, {}};
        const auto d = camera.distort(lens, &fresh.jacobian);
        if (!d) continue;
        fresh.distorted = *d;
        patch = fresh;
      }
      lens = patch->distorted + patch->jacobian * (lens - patch->corrected);
    }
    const Eigen::Vector2d pixel = camera.pixel_from_distorted(lens);
    if (!camera.contains(pixel)) continue;
    const float distance = away.norm(), cosine = facing / (distance * std::max(normal.norm(), 1e-12f));
    seen.push_back({i, cosine, distance, pixel.cast<float>(), place});
  }
}

void SurfaceViewer::remove_hidden(const Projector& projector, std::vector<SeenTexel>& seen, Scratch& scratch) const {
  const auto ray_to = [&](const SeenTexel& s) {
    return hull::Ray{s.place, (projector.center - s.place) / s.distance, std::min(offset_, 0.5f * s.distance),
                     s.distance};
  };
  auto& [rays, hidden] = scratch;
  const std::size_t probes = std::min<std::size_t>(9, seen.size());
  rays.clear();
  for (std::size_t i = 0; i < probes; ++i)
    rays.push_back(ray_to(seen[probes > 1 ? i * (seen.size() - 1) / (probes - 1) : 0]));
  hidden.resize(probes);
  scene_.occluded(rays, hidden);
  const auto in_shadow = std::size_t(std::count(hidden.begin(), hidden.end(), std::uint8_t(1)));
  if (in_shadow == 0) return;
  if (in_shadow == probes) return seen.clear();
  rays.clear();
  for (const SeenTexel& s : seen) rays.push_back(ray_to(s));
  hidden.resize(seen.size());
  scene_.occluded(rays, hidden);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (!hidden[i]) seen[kept++] = seen[i];
  seen.resize(kept);
}

}  // namespace lumihull::slf
