#include "light_fan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "color.h"
#include "fit/mirror.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kPlaces = 400;     // vertices that are looked at
constexpr std::size_t kAround = 48;      // vertices around a place whose mean lightness stands for it
constexpr double kRegion = 0.1;          // radius of a place, in diagonals of the mesh's box
constexpr double kFacing = 0.4;          // least cosine at which a node counts as seeing a place
constexpr double kShadowOffset = 0.003;  // beside the surface, in diagonals of the mesh's box
constexpr double kNearlyUpright = 0.95;  // cosine beyond which a turn about the up axis leaves a direction as it is
constexpr std::size_t kFewestNodes = 3;

/// What terms and reflection add to vertices' lightness (luma of sRGB values, 0 … 1).
class VertexLightness {
 public:
  explicit VertexLightness(const LightField& field) : field_(field) {
    const auto& mesh = field.base.mesh;
    used_.resize(mesh.vertices.size());
    surface_.resize(mesh.vertices.size() * field.terms.size());
    base_.resize(mesh.vertices.size());
    if (field.reflection) light_ = light_of(*field.reflection);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t v = mesh.triangles[t][c];
        if (used_[v]) continue;
        used_[v] = 1;
        if (field.adds_base) base_[v] = luma_at(field.base.texture, field.base.uv[t][c]);
        for (std::size_t k = 0; k < field.terms.size(); ++k) {
          const LightFieldTerm& term = field.terms[k];
          const Image& map = term.surface[field.slot.empty() ? 0 : field.slot[v]];
          surface_[v * field.terms.size() + k] =
              term.surface_scale.scale * luma_at(map, field.base.uv[t][c]) + term.surface_scale.offset;
        }
      }
  }

  bool used(std::size_t vertex) const { return used_[vertex] != 0; }

  float operator()(std::size_t vertex, std::size_t node) const {
    float sum = 0;
    for (std::size_t k = 0; k < field_.terms.size(); ++k) {
      const LightFieldTerm& term = field_.terms[k];
      const float view = term.view_scale.scale * float(term.view[node * used_.size() + vertex]) / 255;
      sum += surface_[vertex * field_.terms.size() + k] * (view + term.view_scale.offset);
    }
    if (!field_.reflection) return sum;
    const LightFieldReflection& r = *field_.reflection;
    const SphereGrid grid(r.light.width());
    const MirrorPlace place = mirror_place(grid, {r.center, r.inverse_radius}, field_.base.mesh.vertices[vertex],
                                           r.normals[vertex], field_.nodes[node]);
    const float strength = r.strength_scale.scale / 255 * float(r.strength[vertex]) + r.strength_scale.offset,
                light = strength * mirrored_light(light_, place).dot(Eigen::Vector3f(0.2126f, 0.7152f, 0.0722f)),
                lit = linear_from_srgb(std::clamp(base_[vertex] + sum, 0.0f, 1.0f)) + light;
    return srgb_from_linear(std::clamp(lit, 0.0f, 1.0f)) - base_[vertex];
  }

 private:
  static float luma_at(const Image& map, const Eigen::Vector2f& uv) {
    const int x = int(std::clamp(uv.x() * float(map.width()), 0.0f, float(map.width() - 1))),
              y = int(std::clamp(uv.y() * float(map.height()), 0.0f, float(map.height() - 1)));
    const std::uint8_t* rgb = map.row<std::uint8_t>(y) + 3 * x;
    return (0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]) / 255;
  }

  const LightField& field_;
  std::vector<std::uint8_t> used_;
  std::vector<float> surface_;  // vertices x terms
  std::vector<float> base_;     // of vertices
  std::vector<Eigen::Vector3f> light_;
};

double cosine_to(const Eigen::Vector3d& normal, const Eigen::Vector3d& way) {
  return way.stableNormalized().dot(normal);
}

/// Turned copies of the way from a place to a node, and the axis.
std::pair<std::vector<Eigen::Vector3d>, Eigen::Vector3d> turned(const Eigen::Vector3d& way, const Eigen::Vector3d& up,
                                                                int count) {
  const bool about_up = std::abs(way.stableNormalized().dot(up)) < kNearlyUpright;
  const Eigen::Vector3d axis = about_up ? up : Eigen::Vector3d(way.unitOrthogonal());
  std::vector<Eigen::Vector3d> ways;
  for (int i = 0; i < count; ++i) {
    const double angle = kFanDegrees * (2.0 * i / (count - 1) - 1) * std::numbers::pi / 180;
    ways.push_back(Eigen::AngleAxisd(angle, axis) * way);
  }
  return {std::move(ways), axis};
}

}  // namespace

std::vector<View> light_fan(const LightField& field, const hull::RayScene& scene, int count, int side) {
  const hull::Mesh& mesh = field.base.mesh;
  if (field.terms.empty() && !field.reflection) return {};
  const std::vector<Eigen::Vector3f> normals = hull::vertex_normals(mesh);
  const VertexLightness lightness(field);
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (lightness.used(v)) box.extend(mesh.vertices[v].cast<double>());
  const double radius = kRegion * box.diagonal().norm();
  if (!(radius > 0)) return {};

  struct Place {
    std::size_t vertex, node;
    double change;  // variance of lightness over the nodes, less for what is seen at a slant
  };
  std::vector<Place> places;
  std::vector<std::size_t> around;
  const std::size_t step = std::max<std::size_t>(1, mesh.vertices.size() / kPlaces);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += step) {
    if (!lightness.used(v)) continue;
    const Eigen::Vector3d middle = mesh.vertices[v].cast<double>(), normal = normals[v].cast<double>();
    around.clear();
    for (std::size_t o = 0; o < mesh.vertices.size(); ++o)
      if (lightness.used(o) && normals[o].dot(normals[v]) > 0.5f &&
          (mesh.vertices[o] - mesh.vertices[v]).squaredNorm() <= float(radius * radius))
        around.push_back(o);
    double sum = 0, squares = 0, best = kFacing;
    std::size_t seen = 0, node = 0;
    for (std::size_t i = 0; i < field.nodes.size(); ++i) {
      const double cosine = cosine_to(normal, field.nodes[i].cast<double>() - middle);
      if (!(cosine > kFacing)) continue;
      if (cosine > best) best = cosine, node = i;
      double value = 0;
      const std::size_t stride = (around.size() + kAround - 1) / kAround;
      std::size_t n = 0;
      for (std::size_t j = 0; j < around.size(); j += stride, ++n) value += lightness(around[j], i);
      value /= double(std::max<std::size_t>(n, 1));
      sum += value, squares += value * value, ++seen;
    }
    if (seen < kFewestNodes) continue;
    const double mean = sum / double(seen), change = squares / double(seen) - mean * mean;
    if (std::isfinite(change)) places.push_back({v, node, best * best * change});  // at a slant: a poor picture
  }
  std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.change > b.change; });

  const float offset = float(kShadowOffset * box.diagonal().norm());
  const Eigen::Vector3d up = field.up.cast<double>().normalized();
  std::vector<View> fan;
  int most = -1;
  for (const Place& place : places) {
    const Eigen::Vector3d middle = mesh.vertices[place.vertex].cast<double>();
    const Eigen::Vector3f beside = mesh.vertices[place.vertex] + offset * normals[place.vertex];
    const auto [ways, axis] = turned(field.nodes[place.node].cast<double>() - middle, up, count);
    int seeing = 0;
    for (const Eigen::Vector3d& way : ways)
      seeing += cosine_to(normals[place.vertex].cast<double>(), way) > 0.1 &&
                !scene.occluded({beside, (middle + way).cast<float>() - beside, 0, 1});
    if (seeing <= most) continue;
    most = seeing;
    fan.clear();
    Camera camera;
    camera.width = camera.height = side;
    camera.u0 = camera.v0 = 0.5 * side;
    for (const Eigen::Vector3d& way : ways) {
      camera.f = 0.5 * side * way.stableNorm() / radius;
      fan.push_back({camera, look_at(middle + way, middle, axis)});
    }
    if (seeing == count) break;
  }
  return fan;
}

}  // namespace lumihull::slf
