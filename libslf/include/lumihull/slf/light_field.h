#pragma once

#include <lumihull/base/api.h>
#include <lumihull/base/image.h>
#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>
#include <lumihull/hull/ray_scene.h>
#include <lumihull/slf/photos.h>
#include <lumihull/slf/renderer.h>
#include <lumihull/slf/textured_mesh.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::slf {

/// A number stored in a byte: value = scale · byte / 255 + offset.
struct ByteScale {
  float scale = 1, offset = 0;
};

/// One product of the factored light field: surface maps times view maps.
struct LightFieldTerm {
  /// What the surface contributes: 8-bit pictures, 3 channels, laid out like the base's texture. One picture, common to
  /// all vertices; or one a slot (LightField::slot), each holding the maps of the vertices of that slot.
  std::vector<Image> surface;
  ByteScale surface_scale;
  /// What the direction contributes: nodes x vertices bytes, the vertices of node 0 first.
  std::vector<std::uint8_t> view;
  ByteScale view_scale;
};

/// What all places of the surface mirror, each as strongly as its material does: linear light on top of their own
/// colour, by the direction that a place's normal mirrors the eye's to. What is mirrored is taken to lie on a sphere.
struct LightFieldReflection {
  Eigen::Vector3f center{0, 0, 0};       ///< of the sphere; directions are from there
  float inverse_radius = 0;              ///< of the sphere, which holds all vertices; 0: infinitely far away
  std::vector<Eigen::Vector3f> normals;  ///< of the vertices, unit length
  std::vector<std::uint8_t> strength;    ///< of the vertices
  ByteScale strength_scale;
  Image light;    ///< square, 8-bit, 3 channels, 3 … 1024 px a side; directions as in SphereGrid
  Image grazing;  ///< as large: what comes on top where a place is seen flatly, times (1 - n·d)³
  ByteScale light_scale, grazing_scale;
};

/// A surface light field on a mesh, factored (Chen, Bouguet, Chu & Grzeszczuk 2002). A surface point p on a triangle
/// with corners v_1 v_2 v_3, seen from the eye e, has the colour (sRGB values, 0 … 1)
///
///     c(p, e) = T(p) + Σ_k Σ_j Λ_j(p) g_k(p) h_k[v_j](e)                    surface maps common to all vertices
///     c(p, e) = T(p) + Σ_k Σ_j Λ_j(p) g_k[slot(v_j)](p) h_k[v_j](e)         surface maps of each vertex
///
/// T the base's texture (left out where `adds_base` is false), Λ_j the barycentric coordinates. View maps are values at
/// nodes, places that an eye may be at: h_k[v](e) = Σ_i w_i(v, e) h_k[v, i], with w the weights of `node_weights`.
/// Terms are in the order of the energy that they contribute: the last ones may be left out. With a reflection E the
/// above, to linear light, plus s(p) E(r, n·d), back to sRGB, is the colour; r = 2 (n·d) n - d, d the way to the eye, n
/// the normal and s the strength, interpolated from the corners'; r is turned to where it meets the sphere.
struct LightField {
  TexturedMesh base;
  bool adds_base = true;
  std::vector<Eigen::Vector3f> nodes;  ///< world, 1 … 255
  Eigen::Vector3f up{0, 0, 1};         ///< the photographs' (see up_axis), unit length: turntables turn about it
  std::vector<std::uint8_t> slot;      ///< of each vertex, no two of a triangle alike; empty: common surface maps
  std::vector<LightFieldTerm> terms;
  std::optional<LightFieldReflection> reflection;
};

inline constexpr int kMaxNodes = 255;
inline constexpr int kMaxTerms = 12;
inline constexpr int kMaxSlots = 16;

/// Throws Error{bad_input} where counts and sizes do not fit together.
LUMIHULL_API void validate(const LightField& field, const std::string& name);

/// How a light field is factored.
enum class Factorization {
  joint,  ///< all vertices together, over common surface maps
  pca,    ///< each vertex's ring of triangles by itself: principal components of the residual over the mean colour
  nmf,    ///< the same of the colours themselves, non-negative; terms are not to be left out
};

struct LightFieldOptions {
  Factorization method = Factorization::joint;
  int terms = 6;  ///< products beyond the mean colour (nmf: in all), 0 … kMaxTerms; joint: those that do not hold
                  ///< at photographs which had no part in them are left out
  int max_nodes = 96;   ///< places where view maps have values: photographs' places, as many of them at most; 4 … 255
  int max_side = 2048;  ///< largest width and height of the maps, 64 … 16384
  double texel_px = 0.5;  ///< size of a texel in pixels of the photographs, at the median over the surface
  int iterations = 8;     ///< joint: alternations between surface and view maps, 1 … 100
  double surface_ridge =
      0.05;  ///< joint: pulls surface maps towards 0 where photographs say little, in shares of their weight
  double view_smoothness = 0.02;  ///< pulls neighbouring nodes' values together, in shares of the photographs' weight
  double min_cosine = 0.15;       ///< flatter views count next to nothing, 0 … 1
  bool reflections =
      true;  ///< joint: looks for what all places mirror alike, and keeps it where left-out photographs are met better
  bool even_exposure = false;  ///< evens out exposure and white balance between the photographs
  double visibility_offset =
      0.003;              ///< how far beside the surface a shadow starts to count, in diagonals of the mesh's box
  double erosion_px = 0;  ///< rim of the photographs' silhouettes that counts next to nothing, px
  double feather_px = 1;  ///< width over which the weight rises to full inside of it, px
  double edge_alpha =
      0.5;  ///< pixels of a softer mask take the colour of the nearest one beyond it; see LumigraphOptions
};

/// What fit_light_field found out on its way.
struct LightFieldReport {
  double texel_size = 0;      ///< world units
  double unseen_share = 0;    ///< share of the surface texels that no photograph saw
  std::uint64_t samples = 0;  ///< texels x photographs that see them
  std::vector<Eigen::Vector3f>
      gains;  ///< even_exposure: of each photograph, linear light, RGB; their geometric mean is 1
  /// Of the samples' variance about each texel's mean, at photographs that had no part in the fit, the share that
  /// mirroring explains; 0: not asked.
  double reflection_share = 0;
  double rms = 0;          ///< of what is left of the samples' colours, sRGB values 0 … 1
  double rms_of_mean = 0;  ///< the same where only the mean colour is used
};

/// Factors the photographs' appearance on a mesh. Errors: invalid_argument (options), bad_input (mesh, views),
/// degenerate (fewer than three photographs, no triangles), unsupported (pca and nmf: the mesh's vertices need more
/// than kMaxSlots slots), and whatever the photographs' reader throws.
LUMIHULL_API LightField fit_light_field(const hull::Mesh& mesh, const PhotoSet& photos,
                                        const LightFieldOptions& options, Job& job, LightFieldReport* report = nullptr);

struct MeshEdge;

/// Renders a light field from any camera, its lens included. Immutable: any number of threads may render.
class LUMIHULL_API LightFieldRenderer {
 public:
  /// terms: how many of the field's terms are used, the first ones; all of them where it has fewer. Errors: bad_input
  /// (see validate).
  explicit LightFieldRenderer(const LightField& field, int terms = kMaxTerms);

  const hull::Mesh& mesh() const { return mesh_; }
  const hull::RayScene& scene() const { return scene_; }

  /// Errors: invalid_argument (options, camera), cancelled.
  Rendering render(const View& view, const RenderOptions& options, Job& job) const;

 private:
  /// View maps of all vertices for one eye: vertices x terms, each value three times, vertices padded to 8 values.
  std::vector<float> view_values(const Eigen::Vector3f& eye, Job& job) const;

  hull::Mesh mesh_;
  hull::RayScene scene_;
  std::shared_ptr<const std::vector<MeshEdge>> edges_;
  std::vector<std::array<Eigen::Vector2f, 3>> uv_;  // in texels
  std::vector<Eigen::Vector3f> nodes_;
  std::vector<std::uint8_t> slot_;
  std::size_t terms_;
  bool adds_base_;
  int width_, height_;
  std::size_t stride_;                 // bytes of a texel in maps_
  std::vector<std::uint8_t> maps_;     // of each texel: texture, then slot by slot its terms' maps; 3 bytes each
  std::vector<ByteScale> map_scales_;  // of each term
  std::vector<float> view_;            // vertices x nodes x terms
  std::vector<Eigen::Vector3f> normals_, mirrored_light_;  // of the vertices; of the sphere's nodes, linear. Or empty
  std::vector<float> strength_;                            // of the vertices
  Eigen::Vector3f mirrored_center_{0, 0, 0};
  float mirrored_inverse_radius_ = 0;
};

}  // namespace lumihull::slf
