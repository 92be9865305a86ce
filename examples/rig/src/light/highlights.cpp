#include <lumihull/hull/ray_scene.h>
#include <lumihull/rig/highlights.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "objects/material.h"
#include "objects/shading_mesh.h"
#include "room.h"

namespace lumihull::rig {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

/// A glossy object with the normals that it is shaded with.
struct Mirror {
  int object = 0;
  std::vector<Material> materials;
  std::function<int(const Vector3f&)> material_at;
  std::vector<std::uint16_t> material_of;
  Vector3f foot{0, 0, 0};
  ShadingMesh shape;
  double size = 1;  ///< longest side, m

  const Material& at(const Vector3d& point, std::size_t triangle) const {
    if (!material_of.empty()) return materials[std::size_t(material_of[triangle])];
    if (!material_at) return materials[0];
    const int k = material_at((point.cast<float>() - foot) / float(size));
    return materials[std::size_t(std::clamp(k, 0, int(materials.size()) - 1))];
  }
};

struct MirrorPoint {
  Vector3d point, normal;
  std::size_t triangle = 0;
};

/// w = n x (v + l) for a point p with normal n, v and l the unit vectors to eye and lamp: zero where n halves the angle
/// between them.
struct Bisector {
  Vector3d eye, lamp;

  Vector3d operator()(const Vector3d& p, const Vector3d& n) const {
    return n.cross((eye - p).normalized() + (lamp - p).normalized());
  }
  /// Of w along a line on which p and n change by dp and dn.
  Vector3d derivative(const Vector3d& p, const Vector3d& n, const Vector3d& dp, const Vector3d& dn) const {
    const Vector3d v = (eye - p).normalized(), l = (lamp - p).normalized();
    const Vector3d dv = -(dp - v * v.dot(dp)) / (eye - p).norm(), dl = -(dp - l * l.dot(dp)) / (lamp - p).norm();
    return dn.cross(v + l) + n.cross(dv + dl);
  }
};

/// The mirror point within a triangle with corners p and normals n, w being the bisector's value at the corners. One is
/// on the border of its triangle as often as not, so the border counts (with 1e-9 to spare).
std::optional<MirrorPoint> mirror_point(const Bisector& bisector, const Vector3d* p, const Vector3d* n,
                                        const Vector3d* w) {
  const Vector3d p1 = p[1] - p[0], p2 = p[2] - p[0], n1 = n[1] - n[0], n2 = n[2] - n[0];
  const Vector3d face = p1.cross(p2);
  if (!(face.squaredNorm() > 0)) return std::nullopt;
  // w is (nearly) perpendicular to the normal: two coordinates across it say all.
  Eigen::Matrix<double, 2, 3> across;
  across.row(0) = p1.normalized();
  across.row(1) = face.cross(p1).normalized();
  const auto solve = [](const Eigen::Matrix2d& m, const Vector2d& right) -> std::optional<Vector2d> {
    const double determinant = m.determinant();
    if (!(std::fabs(determinant) > 1e-14 * m.squaredNorm())) return std::nullopt;
    const Vector2d x = m.inverse() * right;
    return x.allFinite() ? std::optional(x) : std::nullopt;
  };
  Eigen::Matrix2d m;
  m << across * (w[1] - w[0]), across * (w[2] - w[0]);
  auto b = solve(m, -across * w[0]);
  const auto outside = [](const Vector2d& at, double margin) {
    return at.x() < -margin || at.y() < -margin || at.sum() > 1 + margin;
  };
  // As if w were linear; on a triangle that is small beside the surface's radii it nearly is.
  if (!b || outside(*b, .5)) return std::nullopt;
  MirrorPoint at;
  for (int i = 0; i < 12; ++i) {
    at.point = p[0] + b->x() * p1 + b->y() * p2;
    at.normal = n[0] + b->x() * n1 + b->y() * n2;
    m << across * bisector.derivative(at.point, at.normal, p1, n1),
        across * bisector.derivative(at.point, at.normal, p2, n2);
    const auto step = solve(m, across * bisector(at.point, at.normal));
    if (!step) return std::nullopt;
    *b -= *step;
    if (outside(*b, 2)) return std::nullopt;
    if (step->norm() > 1e-12) continue;
    if (outside(*b, 1e-9)) return std::nullopt;
    at.point = p[0] + b->x() * p1 + b->y() * p2;
    at.normal = (n[0] + b->x() * n1 + b->y() * n2).normalized();
    return at;
  }
  return std::nullopt;
}

}  // namespace

struct HighlightFinder::Impl {
  Room room;
  std::vector<Lamp> lamps;
  std::vector<Mirror> mirrors;
  std::optional<hull::RayScene> rays;  ///< all objects, glossy or not

  bool between(const Vector3d& a, const Vector3d& b) const {
    const Vector3f start = a.cast<float>(), way = (b - a).cast<float>();
    return rays->occluded({start, way, 0, 1}) || room.pedestal_between(start, way);
  }

  std::vector<MirrorPoint> mirror_points(const Mirror& mirror, const Bisector& bisector) const {
    const hull::Mesh& mesh = mirror.shape.mesh;
    std::vector<Vector3d> w(mesh.vertices.size(), Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    for (std::size_t i = 0; i < w.size(); ++i) {
      const Vector3d p = mesh.vertices[i].cast<double>(), n = mirror.shape.normals[i].cast<double>();
      // Normals that turn away from eye or lamp by more than the difference within a triangle need no look.
      if (n.dot((bisector.eye - p).normalized()) > -.3 && n.dot((bisector.lamp - p).normalized()) > -.3)
        w[i] = bisector(p, n);
    }
    std::vector<MirrorPoint> found;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      Vector3d p[3], n[3], at[3];
      bool seen = true;
      for (std::size_t k = 0; k < 3; ++k) {
        at[k] = w[t[k]];
        seen = seen && !std::isnan(at[k].x());
      }
      if (!seen) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = mesh.vertices[t[k]].cast<double>();
        n[k] = mirror.shape.normals[t[k]].cast<double>();
      }
      auto point = mirror_point(bisector, p, n, at);
      if (!point) continue;
      point->triangle = i;
      // The one on a border is found from both sides.
      const bool known = std::any_of(found.begin(), found.end(), [&](const MirrorPoint& other) {
        return (other.point - point->point).norm() < 1e-6 * mirror.size;
      });
      if (!known) found.push_back(*point);
    }
    return found;
  }
};

HighlightFinder::HighlightFinder(const Scene& scene) : impl_(new Impl{Room(scene.enclosure), scene.lamps, {}, {}}) {
  hull::Mesh all;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    hull::validate(object.mesh, object.name);
    if (object.mesh.empty()) continue;
    const auto first = std::uint32_t(all.vertices.size());
    all.vertices.insert(all.vertices.end(), object.mesh.vertices.begin(), object.mesh.vertices.end());
    for (const auto& [a, b, c] : object.mesh.triangles) all.triangles.push_back({a + first, b + first, c + first});
    std::vector<Material> materials{object.material};
    materials.insert(materials.end(), object.others.begin(), object.others.end());
    if (std::none_of(materials.begin(), materials.end(),
                     [](const Material& m) { return !m.unlit && m.reflectance > 0; }))
      continue;
    const auto [low, high] = bounding_box(object.mesh);
    impl_->mirrors.push_back({int(i), std::move(materials), object.material_at, object.material_of,
                              Vector3f(0, 0, low.z()), shading_mesh(object, std::numeric_limits<float>::infinity()),
                              double((high - low).maxCoeff())});
  }
  if (!all.empty()) impl_->rays.emplace(all);
}
HighlightFinder::HighlightFinder(HighlightFinder&&) noexcept = default;
HighlightFinder::~HighlightFinder() = default;

bool HighlightFinder::any() const { return !impl_->mirrors.empty(); }

std::vector<Highlight> HighlightFinder::find(const View& view) const {
  view.camera.validate();
  std::vector<Highlight> found;
  const Vector3d eye = view.center();
  for (std::size_t k = 0; k < impl_->lamps.size(); ++k) {
    const Lamp& lamp = impl_->lamps[k];
    const Vector3d shine = lamp.position.cast<double>();
    const std::size_t first = found.size();
    for (const Mirror& mirror : impl_->mirrors)
      for (const auto& [point, normal, triangle] : impl_->mirror_points(mirror, {eye, shine})) {
        const Vector3d to_eye = eye - point, to_lamp = shine - point;
        const double distance = to_lamp.norm();
        const Material& material = mirror.at(point, triangle);
        if (material.unlit) continue;
        const float gloss_here = gloss(material, normal.cast<float>(), (to_lamp / distance).cast<float>(),
                                       to_eye.normalized().cast<float>(), float(lamp.radius / distance));
        if (!(gloss_here > 0)) continue;  // the surface's back
        const auto pixel = view.project(point);
        const Vector3d start = point + 1e-4 * mirror.size * normal;
        if (!pixel || !view.camera.contains(*pixel) || impl_->between(start, eye) || impl_->between(start, shine))
          continue;
        Highlight h;
        h.lamp = int(k);
        h.object = mirror.object;
        h.point = point, h.normal = normal, h.pixel = *pixel;
        h.depth = (view.cam_from_world * point).z();
        h.strength =
            Vector3d(.2126, .7152, .0722).dot(lamp.intensity.cast<double>()) * gloss_here / (distance * distance);
        found.push_back(h);
      }
    std::stable_sort(found.begin() + std::ptrdiff_t(first), found.end(),
                     [](const Highlight& a, const Highlight& b) { return a.strength > b.strength; });
  }
  return found;
}

}  // namespace lumihull::rig
