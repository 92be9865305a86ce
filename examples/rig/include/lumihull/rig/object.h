#pragma once

#include <lumihull/base/image.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lumihull::rig {

/// How the base colour varies over an object that has no texture picture; evaluated in 3-D, so no seams.
enum class Pattern : std::uint8_t {
  plain,    ///< colors[0]
  checker,  ///< cubes of 1/10 of the object's size, colors[0] and [1]
  stripes,  ///< wavy horizontal stripes of colors[0] and [1]
  marble,   ///< colors[0] with veins of [1]
  patches,  ///< colors[0] with islands of [1] and spots of [2], edges about 1/100 of the object's size soft
  pottery,  ///< colors[0] with painted bands and zigzags of [1] and [2]
  fur,      ///< colors[0] in strands of lighter and darker hair, [1] below chin and neck, [2] on crown and nape
};

/// What a surface looks like. Colours are linear reflectances, 0 … 1.
struct Material {
  Pattern pattern = Pattern::plain;
  std::array<Eigen::Vector3f, 3> colors{Eigen::Vector3f(.5f, .5f, .5f), Eigen::Vector3f(.1f, .1f, .1f),
                                        Eigen::Vector3f(.05f, .05f, .05f)};
  float grain = 0.15f;       ///< strength of fine noise on the colour, 0 … 1
  float reflectance = .04f;  ///< mirror reflectance at normal incidence; 0: matt, .04: glaze, .6: metal
  float roughness = .25f;    ///< GGX: alpha = roughness²; 0.05 … 1
  bool soft_mirror = false;  ///< the ceiling's reflection has soft edges as roughness asks; else sharp
  bool unlit = false;        ///< radiance is colors[0] (may be above 1) whatever the light: no pattern, shading, gloss
};

/// A thing to be photographed. z is up; it stands on z = 0, its axis through the origin; metres.
struct Object {
  std::string name;
  hull::Mesh mesh;
  std::vector<Eigen::Vector3f> normals;            ///< one a vertex; empty: from the mesh, with creases at 35°
  std::vector<std::array<Eigen::Vector2f, 3>> uv;  ///< one a triangle's corner, v upwards; empty: no texture
  Image texture;                                   ///< 8-bit sRGB, 3 channels, or empty: `material.pattern`
  Material material;
  /// Further materials, and which a place has: 0 is `material`, k is others[k - 1]. The place is in units of the
  /// longest side, from the middle of the foot, as patterns see it. Empty: `material` all over.
  std::vector<Material> others;
  std::function<int(const Eigen::Vector3f& place)> material_at;
  float stand = 0;  ///< radius of the pedestal that suits it, m; 0: a quarter wider than the object
};

/// Objects made by formula, `size` metres along the longest side of their box, `detail` cells along it.
/// vase: surface of revolution with ridges, hollow neck, handle (genus 1). bust: a glossy, nearly convex head.
/// statue: a dark figure with its arms akimbo (genus 3). gate: a pale slab with a wide bore, two narrow ones that few
/// photographs see through, and one through its length (genus 4). box: twelve triangles, checker. sphere: radius size /
/// 2, vertices on it to float accuracy, 20 * 4^n triangles.
Object make_vase(double size, int detail = 100);
Object make_bust(double size, int detail = 100);
Object make_statue(double size, int detail = 130);
Object make_gate(double size, int detail = 100);
/// Stand-ins for the objects of the paper's table 1. snowmobile: 2.8 m long, lacquered, with black parts, an opaque
/// dark windscreen, skis, a track (front at -x). deer: a matt furry head on its neck, with antlers (genus 0).
Object make_snowmobile(double size, int detail = 150);
Object make_deer(double size, int detail = 130);
Object make_box(double size);
Object make_sphere(double size, int subdivisions = 6);

/// A pebble: convex, smooth, glossy, in soft patches of moderate contrast; 20 * 4^n triangles (n from 1 to 8), vertices
/// and normals by the formula to float accuracy.
Object make_pebble(double size, int subdivisions = 6);
/// The pebble's formula for size 1: a convex function, twice continuously differentiable, zero on the surface, negative
/// inside. The long axis goes from x = -1/2 to 1/2, the foot is the origin. gradient (outwards) if wanted.
double pebble_function(const Eigen::Vector3d& p, Eigen::Vector3d* gradient = nullptr);

/// Reads a mesh (PLY, OBJ), makes it stand on z = 0 (`y_up`: the file's y axis is up) and scales it to `size` metres.
/// An OBJ file's texture coordinates are read where a `texture` picture is given.
/// Errors: those of hull::read_mesh and read_image; bad_input naming file and line where texture coordinates are
/// missing, not finite or indices are out of range.
Object read_object(const std::filesystem::path& mesh, const std::filesystem::path& texture, double size, bool y_up);

/// By name ("vase", "bust", "statue", "snowmobile", "deer", "gate", "box", "sphere", "pebble") or a mesh file (y up for
/// OBJ, z up for PLY; a PNG of the same name beside an OBJ is its texture). Error{invalid_argument} for a name that is
/// neither.
Object object_by_name(const std::string& name, double size);

/// The object's bounding box in its mesh: {low, high}; undefined for an empty mesh.
std::array<Eigen::Vector3f, 2> bounding_box(const hull::Mesh& mesh);

}  // namespace lumihull::rig
