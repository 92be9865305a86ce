// Which sheets a view can decode, and more of them where there are too few.

#include <lumihull/hull/ray_scene.h>
#include <lumihull/rig/target_sheets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "light/room.h"
#include "light/scattering.h"
#include "objects/noise.h"

namespace lumihull::rig {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

hull::Mesh one_mesh(const Scene& scene) {
  hull::Mesh all;
  for (const Object& object : scene.objects) {
    const auto first = std::uint32_t(all.vertices.size());
    all.vertices.insert(all.vertices.end(), object.mesh.vertices.begin(), object.mesh.vertices.end());
    for (auto triangle : object.mesh.triangles) {
      for (auto& corner : triangle) corner += first;
      all.triangles.push_back(triangle);
    }
  }
  return all;
}

}  // namespace

struct TargetSights::Impl {
  Scene scene;
  TargetReach reach;
  Room room;
  std::optional<hull::RayScene> object;
};

TargetSights::TargetSights(const Scene& scene, const TargetReach& reach) {
  auto impl = std::make_unique<Impl>(Impl{scene, reach, Room(scene.enclosure), std::nullopt});
  if (const hull::Mesh mesh = one_mesh(scene); !mesh.triangles.empty()) impl->object.emplace(mesh);
  impl_ = std::move(impl);
}
TargetSights::TargetSights(TargetSights&&) noexcept = default;
TargetSights::~TargetSights() = default;

const Scene& TargetSights::scene() const { return impl_->scene; }

bool TargetSights::hidden(const Vector3d& from, const Vector3d& to) const {
  const Eigen::Vector3f start = from.cast<float>(), way = (to - from).cast<float>();
  return (impl_->object && impl_->object->occluded({start, way, 0, .999f})) ||
         impl_->room.pedestal_between(start, .999f * way);
}

bool TargetSights::decodable(const View& view, const calib::TargetDesign& design, const Pose& world_from_target) const {
  const Vector3d eye = view.center();
  // The print's z points into the paper.
  if ((world_from_target.inverse() * eye).z() >= 0) return false;
  const int n = design.family.grid();
  const double r = design.circle_radius_m(), border = impl_->reach.border * view.camera.width;
  const auto inside = [&](const Vector2d& px) {
    return px.x() > border && px.y() > border && px.x() < view.camera.width - border &&
           px.y() < view.camera.height - border;
  };
  for (const int corner : {0, n - 1, n * n - n, n * n - 1}) {
    const Vector2d at = design.feature(corner);
    const Vector3d place = world_from_target * Vector3d(at.x(), at.y(), 0);
    Matrix23d by_point;
    const auto px = view.camera.project(view.cam_from_world * place, &by_point);
    if (!px || !inside(*px)) return false;
    for (const double dx : {-r, r})
      for (const double dy : {-r, r}) {
        const auto edge = view.project(world_from_target * Vector3d(at.x() + dx, at.y() + dy, 0));
        if (!edge || !inside(*edge)) return false;
      }
    // The circle's image, to first order: its smaller semi-axis is the smaller singular value.
    const Eigen::Matrix3d axes = (view.cam_from_world.rotation * world_from_target.rotation).toRotationMatrix();
    const Eigen::Matrix2d image = by_point * axes.leftCols<2>() * r;
    const double sum = image.squaredNorm(), det = std::fabs(image.determinant());
    const double least = std::sqrt(std::max(0., .5 * (sum - std::sqrt(std::max(0., sum * sum - 4 * det * det)))));
    if (2 * least < impl_->reach.least_circle_px) return false;
    if (hidden(eye, place)) return false;
  }
  return !hidden(eye, world_from_target.translation);
}

std::vector<std::size_t> TargetSights::decodable(const View& view, const RoomTargets& targets) const {
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < targets.placed.size(); ++i) {
    const PlacedTarget& t = targets.placed[i];
    if (decodable(view, targets.set.designs[std::size_t(t.design)], t.world_from_target)) seen.push_back(i);
  }
  return seen;
}

std::vector<std::size_t> add_sheets(RoomTargets& targets, std::span<const View> views, int least,
                                    const TargetSights& sights, std::uint64_t seed) {
  const Room room(sights.scene().enclosure);
  std::vector<std::size_t> poor;
  std::uint64_t draws = 0;
  const auto random = [&] { return unit_double(mix(mix(seed, 0xadd), draws++)); };
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& view = views[i];
    int seen = int(sights.decodable(view, targets).size());
    constexpr int kAttempts = 3000;
    for (int attempt = 0; attempt < kAttempts && seen < least; ++attempt) {
      const auto ray = view.camera.ray({random() * view.camera.width, random() * view.camera.height});
      if (!ray) continue;
      const Vector3d eye = view.center(), way = view.cam_from_world.rotation.conjugate() * *ray;
      const RoomHit hit = room.hit(eye.cast<float>(), way.cast<float>());
      if (hit.surface != Room::kFloor && hit.surface < Room::kPanels) continue;
      if (sights.hidden(eye, hit.point.cast<double>())) continue;
      // Large sheets first; where they find no place, smaller ones.
      const int designs = int(targets.set.designs.size());
      const int design = std::max(0, designs - 1 - attempt * designs / kAttempts);
      const auto pose = free_place(targets, sights.scene(), design, hit, 2 * random() - 1);
      if (!pose || !sights.decodable(view, targets.set.designs[std::size_t(design)], *pose)) continue;
      hang(targets, design, *pose, hit.surface == Room::kFloor ? "floor" : "wall");
      ++seen;
    }
    if (seen < least) poor.push_back(i);
  }
  if (!targets.placed.empty()) targets.set.validate();
  return poor;
}

}  // namespace lumihull::rig
