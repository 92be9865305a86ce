#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>
#include <lumihull/slf/camera_path.h>
#include <lumihull/slf/light_field.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "atlas/atlas.h"
#include "atlas/surface_fill.h"
#include "atlas/surface_samples.h"
#include "color.h"
#include "exposure.h"
#include "glb/byte_scale.h"
#include "joint_fit.h"
#include "light_field_terms.h"
#include "photos/photo_options.h"
#include "reflection_fit.h"
#include "render/surface_viewer.h"
#include "ring_fit.h"
#include "rings.h"
#include "view_nodes.h"

namespace lumihull::slf {
namespace {

constexpr double kLeastMirrored = 0.004;  // root mean square of what holds of a reflection, below which it is dropped

void check(const LightFieldOptions& o) {
  constexpr const char* kWhose = "light field options";
  require(o.terms >= 0 && o.terms <= kMaxTerms, "terms: expected 0 to 12", kWhose);
  require(o.max_nodes >= 4 && o.max_nodes <= kMaxNodes, "max_nodes: expected 4 to 255", kWhose);
  require(o.max_side >= 64 && o.max_side <= 16384, "max_side: expected 64 to 16384", kWhose);
  require(o.texel_px >= 0.1 && o.texel_px <= 100, "texel_px: expected 0.1 to 100", kWhose);
  require(o.iterations >= 1 && o.iterations <= 100, "iterations: expected 1 to 100", kWhose);
  require(o.surface_ridge >= 0 && o.surface_ridge <= 10, "surface_ridge: expected 0 to 10", kWhose);
  require(o.view_smoothness >= 0 && o.view_smoothness <= 100, "view_smoothness: expected 0 to 100", kWhose);
  check_photo_options(o, kWhose);
}

/// The mean colour of each texel, all of them known; how many had to be filled in.
std::vector<BlendColor> mean_colors(const hull::Mesh& mesh, const Atlas& atlas, const JointFactors& factors,
                                    std::size_t& filled) {
  std::vector<BlendColor> colors(atlas.texels.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const float w = factors.seen[i];
    colors[i] = {w * factors.mean[3 * i], w * factors.mean[3 * i + 1], w * factors.mean[3 * i + 2], w};
  }
  filled = fill_surface(mesh, atlas, colors);
  return colors;
}

LightFieldReflection reflection_of(const ReflectionFit& fit) {
  LightFieldReflection out;
  out.center = fit.around.center, out.inverse_radius = fit.around.inverse_radius;
  out.normals = fit.normals;
  out.strength_scale = {kMostStrength, 0};
  for (const float s : fit.strength) out.strength.push_back(to_byte(s, out.strength_scale));
  const auto picture = [&](std::size_t first, ByteScale& scale) {
    const std::span<const Eigen::Vector3f> light(&fit.light[first], std::size_t(kReflectionSide * kReflectionSide));
    float low = 0, high = 0;
    for (const auto& l : light) low = std::min(low, l.minCoeff()), high = std::max(high, l.maxCoeff());
    scale = {std::max(high - low, 1e-6f), low};
    Image map(kReflectionSide, kReflectionSide, 3);
    for (std::size_t i = 0; i < light.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        map.row<std::uint8_t>(0)[3 * i + c] = to_byte(light[i][std::ptrdiff_t(c)], scale);
    return map;
  };
  out.light = picture(0, out.light_scale);
  out.grazing = picture(fit.light.size() / 2, out.grazing_scale);
  return out;
}

/// The photographs whose places are nodes, ascending.
std::vector<std::uint32_t> photos_at_nodes(const hull::Mesh& mesh, std::span<const PhotoSamples> samples,
                                           std::size_t most) {
  std::vector<Eigen::Vector3f> places;
  for (const PhotoSamples& p : samples) places.push_back(p.center);
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  return choose_nodes(places, box.center(), most);
}

/// Whether a reflection is worth it: photographs that had no part in the fit are met better with it than with the mean
/// colour alone, and better than the terms meet them without it.
bool holds(const ReflectionFit& reflection, const hull::Mesh& mesh, const Atlas& atlas,
           std::span<const PhotoSamples> samples, std::span<const Eigen::Vector3f> nodes,
           std::span<const std::uint32_t> at_node, const JointFitOptions& options, Job& job) {
  if (!(reflection.held > 0 && reflection.held_rms > kLeastMirrored)) return false;
  return options.terms == 0 || reflection.held > JointFit(mesh, atlas, samples, nodes, at_node, options).held(job);
}

}  // namespace

void validate(const LightField& field, const std::string& name) {
  const auto fail = [&](const std::string& what) { throw Error(ErrorCode::bad_input, what, name); };
  validate(field.base, name);
  const std::size_t vertices = field.base.mesh.vertices.size();
  if (field.nodes.empty() || field.nodes.size() > std::size_t(kMaxNodes)) fail("expected 1 to 255 nodes");
  for (const auto& n : field.nodes)
    if (!n.allFinite()) fail("a node's place is not finite");
  if (!field.up.allFinite() || std::abs(field.up.norm() - 1) > 1e-3f) fail("expected an up of unit length");
  std::size_t slots = 1;
  if (!field.slot.empty()) {
    if (field.slot.size() != vertices) fail("expected a slot for each vertex");
    slots = std::size_t(*std::max_element(field.slot.begin(), field.slot.end())) + 1;
    if (slots > std::size_t(kMaxSlots)) fail("expected slots below 16");
    for (std::size_t i = 0; i < field.base.mesh.triangles.size(); ++i) {
      const auto& t = field.base.mesh.triangles[i];
      for (int j = 0; j < 3; ++j)
        if (t[j] != t[(j + 1) % 3] && field.slot[t[j]] == field.slot[t[(j + 1) % 3]])
          fail("triangle " + std::to_string(i) + " has two corners of one slot");
    }
  }
  if (field.reflection) {
    const LightFieldReflection& r = *field.reflection;
    if (r.normals.size() != vertices || r.strength.size() != vertices)
      fail("reflection: expected a normal and a strength for each vertex");
    if (!r.center.allFinite() || !std::isfinite(r.inverse_radius) || r.inverse_radius < 0)
      fail("reflection: expected a sphere with a finite centre and a radius above 0");
    for (const auto& v : field.base.mesh.vertices)
      if (!(r.inverse_radius * (v - r.center).norm() < 1)) fail("reflection: the sphere does not hold all vertices");
    for (const auto& n : r.normals)
      if (!n.allFinite() || std::abs(n.norm() - 1) > 0.02f) fail("reflection: expected normals of unit length");
    for (const Image* map : {&r.light, &r.grazing})
      if (map->width() != map->height() || map->width() < 3 || map->width() > 1024 || map->width() != r.light.width() ||
          map->channels() != 3 || map->type() != PixelType::u8)
        fail("reflection: expected two square maps of 8-bit RGB, 3 to 1024 pixels a side");
    for (const ByteScale& s : {r.light_scale, r.grazing_scale, r.strength_scale})
      if (!std::isfinite(s.scale) || !std::isfinite(s.offset)) fail("reflection: scale and offset are not finite");
  }
  if (field.terms.size() > std::size_t(kMaxTerms)) fail("expected at most 12 terms");
  for (std::size_t k = 0; k < field.terms.size(); ++k) {
    const LightFieldTerm& term = field.terms[k];
    const std::string which = "term " + std::to_string(k) + ": ";
    if (term.surface.size() != slots) fail(which + "expected a surface map for each slot");
    for (const Image& map : term.surface)
      if (map.width() != field.base.texture.width() || map.height() != field.base.texture.height() ||
          map.channels() != 3 || map.type() != PixelType::u8)
        fail(which + "expected surface maps of 8-bit RGB, as large as the texture");
    if (term.view.size() != vertices * field.nodes.size())
      fail(which + "expected a view map's value for each vertex and node");
    for (const ByteScale& s : {term.surface_scale, term.view_scale})
      if (!std::isfinite(s.scale) || !std::isfinite(s.offset)) fail(which + "scale and offset are not finite");
  }
}

LightField fit_light_field(const hull::Mesh& mesh, const PhotoSet& photos, const LightFieldOptions& options, Job& job,
                           LightFieldReport* report) {
  check(options);
  validate(photos);
  hull::validate(mesh, "mesh");
  if (photos.size() < 3)
    throw Error(ErrorCode::degenerate,
                "a light field needs at least three photographs, not " + std::to_string(photos.size()));
  if (mesh.triangles.empty()) throw Error(ErrorCode::degenerate, "the mesh has no triangles to colour");

  const bool joint = options.method == Factorization::joint, non_negative = options.method == Factorization::nmf;
  const bool rings_apart = !joint && options.terms > 0;
  std::vector<std::uint8_t> slot;
  if (rings_apart) slot = slots_of(mesh);

  const hull::RayScene scene(mesh);
  const Atlas atlas = make_atlas(mesh, options.texel_px * finest_pixel(mesh, photos), options.max_side);
  std::vector<PhotoSamples> samples;
  {
    const SurfaceViewer viewer(mesh, scene, atlas, shadow_offset(mesh, options.visibility_offset));
    EdgeOptions edge = edge_options(options);
    edge.clean_rim = true;
    samples =
        collect_samples(viewer, atlas, photos, {edge, float(options.min_cosine), ordinary_pixel(mesh, photos)}, job);
  }

  std::vector<Eigen::Vector3f> gains;
  if (options.even_exposure) {
    gains = exposure_gains(atlas, samples, job);
    parallel_for(job, samples.size(), [&](std::size_t i) { divide_by_gain(samples[i], gains[i]); });
  }

  LightField field;
  const std::vector<std::uint32_t> at_node = photos_at_nodes(mesh, samples, std::size_t(options.max_nodes));
  for (const std::uint32_t i : at_node) field.nodes.push_back(samples[i].center);
  const JointFitOptions fit_options{joint ? options.terms : 0, options.iterations, options.surface_ridge,
                                    options.view_smoothness, !rings_apart};
  double reflection_share = 0;
  if (joint && options.reflections) {
    const ReflectionFit reflection = fit_reflection(mesh, atlas, samples, job);
    reflection_share = reflection.held;
    if (holds(reflection, mesh, atlas, samples, field.nodes, at_node, fit_options, job)) {
      take_off(reflection, mesh, atlas, samples, job);
      field.reflection = reflection_of(reflection);
    }
  }
  field.base.mesh = mesh;
  field.up = up_axis(photos.views).cast<float>();
  field.adds_base = !non_negative || options.terms == 0;

  JointFit fit(mesh, atlas, samples, field.nodes, at_node, fit_options);
  const JointFactors factors = fit.run(job);
  double rms = fit.rms;
  std::size_t filled = 0;
  const std::vector<BlendColor> colors = mean_colors(mesh, atlas, factors, filled);
  field.base.texture = texture_picture(atlas, colors);
  field.base.uv = atlas.uv;
  const Eigen::Vector2f size(float(atlas.width), float(atlas.height));
  for (auto& corners : field.base.uv)
    for (auto& uv : corners) uv = uv.cwiseQuotient(size).cwiseMax(0.0f).cwiseMin(1.0f);

  if (joint) {
    field.terms = terms_of(factors, atlas, mesh.vertices.size(), field.nodes.size(), std::size_t(options.terms), rms);
    field.terms.resize(fit.kept());
  } else if (rings_apart) {
    Rings rings = make_rings(mesh, atlas, std::move(slot));
    const RingFitOptions ring_options{non_negative, options.terms, options.view_smoothness};
    const RingFactors ring_factors = fit_rings(mesh, atlas, rings, samples, field.nodes, colors, ring_options, job);
    field.terms = terms_of(ring_factors, atlas, rings, field.nodes.size(), ring_options);
    field.slot = std::move(rings.slot);
    rms = ring_factors.rms;
  }
  if (report) {
    report->texel_size = atlas.texel_size;
    report->unseen_share = double(filled) / double(std::max<std::size_t>(1, atlas.texels.size()));
    report->samples = 0;
    for (const PhotoSamples& p : samples) report->samples += p.samples.size();
    report->gains = std::move(gains);
    report->reflection_share = reflection_share;
    report->rms = rms;
    report->rms_of_mean = fit.rms_of_mean;
  }
  return field;
}

}  // namespace lumihull::slf
