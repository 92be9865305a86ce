#include "light_field_terms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "atlas/surface_fill.h"
#include "color.h"
#include "glb/byte_scale.h"

namespace lumihull::slf {
namespace {

constexpr double kRounding =
    0.15;  // of view maps to bytes: what a term may err by it, in shares of what the fit leaves
constexpr double kClippedViews = 1e-4;  // share of the non-negative view maps' values that bytes leave out

using Bytes = std::array<std::uint8_t, 3>;

BlendColor as_color(const Bytes& b) { return {unit_of_srgb8(b[0]), unit_of_srgb8(b[1]), unit_of_srgb8(b[2]), 1}; }

/// Term `k` of view maps (vertices x nodes x terms), node by node.
void set_view(const std::vector<float>& view, std::size_t vertices, std::size_t nodes, std::size_t terms, std::size_t k,
              bool non_negative, float least_step, LightFieldTerm& term) {
  std::vector<float> values(vertices * nodes);
  for (std::size_t v = 0; v < vertices; ++v)
    for (std::size_t i = 0; i < nodes; ++i) values[i * vertices + v] = view[(v * nodes + i) * terms + k];
  term.view_scale = non_negative ? positive_range_of(values, kClippedViews) : signed_range_of(values, least_step);
  term.view.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) term.view[i] = to_byte(values[i], term.view_scale);
}

/// Term `k` of surface maps (rows x terms x 3) by itself: rows x 3.
std::vector<float> surface_of(const std::vector<float>& surface, std::size_t terms, std::size_t k) {
  std::vector<float> out(surface.size() / terms);
  for (std::size_t i = 0; i < out.size() / 3; ++i) std::copy_n(&surface[(i * terms + k) * 3], 3, &out[3 * i]);
  return out;
}

}  // namespace

std::vector<LightFieldTerm> terms_of(const JointFactors& factors, const Atlas& atlas, std::size_t vertices,
                                     std::size_t nodes, std::size_t terms, double rms) {
  std::vector<LightFieldTerm> out(terms);
  std::vector<BlendColor> texels(atlas.texels.size());
  for (std::size_t k = 0; k < terms; ++k) {
    const std::vector<float> values = surface_of(factors.surface, terms, k);
    const ByteScale scale = out[k].surface_scale = signed_range_of(values);
    for (std::size_t i = 0; i < texels.size(); ++i)
      texels[i] = as_color(
          {to_byte(values[3 * i], scale), to_byte(values[3 * i + 1], scale), to_byte(values[3 * i + 2], scale)});
    out[k].surface.push_back(texture_picture(atlas, texels));
    // Uniform rounding errs by step / √12, which the surface map multiplies.
    double square = 0;
    for (const float g : values) square += double(g) * g;
    const double size = std::sqrt(square / double(std::max<std::size_t>(1, values.size())));
    const double step = size > 0 ? kRounding * rms * std::sqrt(12.0) / size : 0;
    set_view(factors.view, vertices, nodes, terms, k, false, float(step), out[k]);
  }
  return out;
}

std::vector<LightFieldTerm> terms_of(const RingFactors& factors, const Atlas& atlas, const Rings& rings,
                                     std::size_t nodes, const RingFitOptions& options) {
  const std::size_t vertices = rings.slot.size(), terms = std::size_t(options.terms);
  const int slots = *std::max_element(rings.slot.begin(), rings.slot.end()) + 1;
  std::vector<LightFieldTerm> out(terms);
  for (std::size_t k = 0; k < terms; ++k) {
    const std::vector<float> values = surface_of(factors.surface, terms, k);
    const ByteScale scale = out[k].surface_scale =
        options.non_negative ? positive_range_of(values, 0) : signed_range_of(values);
    for (int slot = 0; slot < slots; ++slot) {
      std::vector<BlendColor> texels(atlas.texels.size());  // those of no ring continue the ones around
      for (std::size_t v = 0; v < vertices; ++v) {
        if (rings.slot[v] != slot) continue;
        for (std::size_t i = rings.first[v]; i < rings.first[v + 1]; ++i)
          texels[rings.texels[i].texel] = as_color(
              {to_byte(values[3 * i], scale), to_byte(values[3 * i + 1], scale), to_byte(values[3 * i + 2], scale)});
      }
      out[k].surface.push_back(texture_picture(atlas, texels));
    }
    set_view(factors.view, vertices, nodes, terms, k, options.non_negative, 0, out[k]);
  }
  return out;
}

}  // namespace lumihull::slf
