#pragma once

#include <lumihull/base/job.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/rig/photographer.h>

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "room.h"

namespace lumihull::rig {

/// Values on a grid of nodes over [0, 1]², bilinear between them.
struct LightMap {
  int columns = 0, rows = 0;  ///< >= 2
  std::vector<Eigen::Vector3f> values;

  Eigen::Vector3f at(float u, float v) const;
};

/// A scene together with the light that does not depend on where the camera is. "Light" of a place is what a white
/// diffuse surface there would radiate.
class LitScene {
 public:
  LitScene(const Scene& scene, const LightOptions& options, Job& job);

  const Room& room() const { return room_; }
  /// Of the ball around all objects.
  const Eigen::Vector3f& center() const { return center_; }
  /// First object along each ray; all misses in an empty room.
  void hit(std::span<const hull::Ray> rays, std::span<hull::Hit> hits) const;
  /// Index of the object that a triangle belongs to.
  std::uint32_t object_of(std::uint32_t triangle) const { return object_of_[triangle]; }

  Eigen::Vector3f object_radiance(const hull::Ray& ray, const hull::Hit& hit, Shown shown = Shown::all) const;
  Eigen::Vector3f room_radiance(const RoomHit& hit) const;
  /// Light at a place of the room; the ceiling has none.
  Eigen::Vector3f room_light(const RoomHit& hit) const;
  const std::vector<FlatPrint>& sheets() const { return sheets_; }

 private:
  struct Part {
    std::vector<Material> materials;
    std::function<int(const Eigen::Vector3f&)> material_at;
    std::uint32_t first_triangle = 0;
    Eigen::Vector3f foot{0, 0, 0};
    float size = 1;
    std::vector<std::array<Eigen::Vector2f, 3>> uv;
    std::vector<Image> textures;  ///< one a material, or one for all
    std::vector<std::uint16_t> material_of;
    std::uint32_t split = 1;  ///< into how many a triangle of the object was split

    /// Number of the material at a point on one of mesh_'s triangles.
    std::size_t material_index(const Eigen::Vector3f& point, std::uint32_t triangle) const;
  };

  void add(const Object& object, float vertex_spacing);
  void look_at_materials();
  void light_room(const LightOptions& options, Job& job);
  void light_objects(const LightOptions& options, Job& job);
  void smooth_light();
  /// Where a ray goes on from an object.
  struct Touch {
    Eigen::Vector3f point, normal;  ///< the normal on the ray's side
    Eigen::Vector3f albedo, radiance;
  };
  Touch touch(const hull::Ray& ray, const hull::Hit& hit) const;
  /// Light that arrives along a path: what its first place radiates, and what it gathers from there on. first: what the
  /// first ray meets, if known. room_done: the room's light holds all bounces, so that a path ends there.
  Eigen::Vector3f path_light(const hull::Ray& ray, const hull::Hit* first, std::uint64_t turn, int bounces,
                             bool room_done) const;
  Eigen::Vector3f lamps_at(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, int rays,
                           std::uint64_t turn) const;
  Eigen::Vector3f base_color(const Part& part, std::size_t material, const hull::Hit& hit,
                             const Eigen::Vector3f& point) const;
  /// What a mirror shows whose reflections turn by up to `blur` (sine): the ceiling's bright edge is softened, the only
  /// one with much contrast.
  Eigen::Vector3f blurred_room(const Eigen::Vector3f& from, const Eigen::Vector3f& way, float blur) const;
  bool blocked(const Eigen::Vector3f& point, const Eigen::Vector3f& way) const;

  Room room_;
  std::vector<Lamp> lamps_;
  std::vector<FlatPrint> sheets_;
  Eigen::Vector3f center_;
  float radius_ = 0;
  float offset_ = 0;  ///< how far shadow rays start from a surface, m
  hull::Mesh mesh_;   ///< all objects, vertices doubled along creases, triangles split to a light vertex spacing
  std::vector<Eigen::Vector3f> normals_, light_;  ///< one a vertex of mesh_
  std::vector<Eigen::Vector3f> albedo_, glow_;    ///< what it scatters; what an unlit vertex radiates
  std::vector<std::uint32_t> object_of_;
  std::vector<Part> parts_;
  std::optional<hull::RayScene> rays_;
  float near_floor_ = 0;  ///< half side of the finer light map around the axis, m
  LightMap floor_near_, floor_far_, pedestal_top_, pedestal_side_;
  std::vector<LightMap> panels_;
};

}  // namespace lumihull::rig
