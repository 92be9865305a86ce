#include <lumihull/base/error.h>
#include <lumihull/slf/light_field.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "atlas.h"
#include "color.h"
#include "joint_fit.h"
#include "photo_options.h"
#include "surface_fill.h"
#include "surface_samples.h"
#include "surface_viewer.h"
#include "view_nodes.h"

namespace lumihull::slf {
namespace {

constexpr double kClipped = 1e-4;  // share of the values that the byte range leaves out at each end

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

/// The range that holds all values but a few outliers, around zero so that zero is a byte's value.
ByteScale range_of(std::vector<float> values) {
  if (values.empty()) return {};
  for (float& v : values) v = std::abs(v);
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * (1 - kClipped));
  std::nth_element(values.begin(), at, values.end());
  const float most = std::max(*at, 1e-6f);
  // 128 stands for zero.
  return {2 * most * 255 / 254, -2 * most * 128 / 254};
}

std::uint8_t to_byte(float value, const ByteScale& s) {
  return std::uint8_t(std::clamp((value - s.offset) / s.scale * 255 + 0.5f, 0.0f, 255.0f));
}

}  // namespace

void validate(const LightField& field, const std::string& name) {
  const auto fail = [&](const std::string& what) { throw Error(ErrorCode::bad_input, what, name); };
  validate(field.base, name);
  const std::size_t vertices = field.base.mesh.vertices.size();
  if (field.nodes.empty() || field.nodes.size() > std::size_t(kMaxNodes)) fail("expected 1 to 255 nodes");
  for (const auto& n : field.nodes)
    if (!n.allFinite()) fail("a node's place is not finite");
  std::size_t slots = 1;
  if (!field.slot.empty()) {
    if (field.slot.size() != vertices) fail("expected a slot for each vertex");
    slots = std::size_t(*std::max_element(field.slot.begin(), field.slot.end())) + 1;
    if (slots > std::size_t(kMaxSlots)) fail("expected slots below 16");
    for (std::size_t i = 0; i < field.base.mesh.triangles.size(); ++i) {
      const auto& t = field.base.mesh.triangles[i];
      if (field.slot[t[0]] == field.slot[t[1]] || field.slot[t[1]] == field.slot[t[2]] ||
          field.slot[t[2]] == field.slot[t[0]])
        fail("triangle " + std::to_string(i) + " has two corners of one slot");
    }
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

  const hull::RayScene scene(mesh);
  const Atlas atlas = make_atlas(mesh, options.texel_px * finest_pixel(mesh, photos), options.max_side);
  std::vector<PhotoSamples> samples;
  {
    const SurfaceViewer viewer(mesh, scene, atlas, shadow_offset(mesh, options.visibility_offset));
    samples = collect_samples(viewer, atlas, photos,
                              {edge_options(options), float(options.min_cosine), ordinary_pixel(mesh, photos)}, job);
  }

  LightField field;
  field.base.mesh = mesh;
  std::vector<Eigen::Vector3f> places;
  for (const PhotoSamples& p : samples) places.push_back(p.center);
  Eigen::AlignedBox3f box;
  for (const auto& v : mesh.vertices) box.extend(v);
  for (const std::uint32_t i : choose_nodes(places, box.center(), std::size_t(options.max_nodes)))
    field.nodes.push_back(places[i]);

  JointFit fit(mesh, atlas, samples, field.nodes,
               {options.terms, options.iterations, options.surface_ridge, options.view_smoothness});
  const JointFactors factors = fit.run(job);

  const std::size_t texels = atlas.texels.size(), terms = std::size_t(options.terms);
  std::vector<BlendColor> colors(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    const float w = factors.seen[i];
    colors[i] = {w * factors.mean[3 * i], w * factors.mean[3 * i + 1], w * factors.mean[3 * i + 2], w};
  }
  const std::size_t filled = fill_surface(mesh, atlas, colors);
  field.base.texture = texture_picture(atlas, colors);
  field.base.uv = atlas.uv;
  const Eigen::Vector2f size(float(atlas.width), float(atlas.height));
  for (auto& corners : field.base.uv)
    for (auto& uv : corners) uv = uv.cwiseQuotient(size).cwiseMax(0.0f).cwiseMin(1.0f);

  const std::size_t vertices = mesh.vertices.size(), nodes = field.nodes.size();
  for (std::size_t k = 0; k < terms; ++k) {
    LightFieldTerm term;
    std::vector<float> values(texels * 3);
    for (std::size_t i = 0; i < texels; ++i) std::copy_n(&factors.surface[(i * terms + k) * 3], 3, &values[3 * i]);
    term.surface_scale = range_of(values);
    for (std::size_t i = 0; i < texels; ++i) {
      const auto unit = [&](std::size_t c) {
        return float(to_byte(values[3 * i + c], term.surface_scale)) * (1.0f / 255.0f);
      };
      colors[i] = {unit(0), unit(1), unit(2), 1};
    }
    term.surface.push_back(texture_picture(atlas, colors));
    values.resize(vertices * nodes);
    for (std::size_t v = 0; v < vertices; ++v)
      for (std::size_t i = 0; i < nodes; ++i) values[i * vertices + v] = factors.view[(v * nodes + i) * terms + k];
    term.view_scale = range_of(values);
    term.view.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) term.view[i] = to_byte(values[i], term.view_scale);
    field.terms.push_back(std::move(term));
  }
  if (report) {
    report->texel_size = atlas.texel_size;
    report->unseen_share = double(filled) / double(std::max<std::size_t>(1, texels));
    report->samples = 0;
    for (const PhotoSamples& p : samples) report->samples += p.samples.size();
    report->rms = fit.rms;
    report->rms_of_mean = fit.rms_of_mean;
  }
  return field;
}

}  // namespace lumihull::slf
