#include <lumihull/slf/light_field.h>

#include <algorithm>
#include <cmath>

#include "render_with.h"
#include "view_nodes.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kVerticesAtOnce = 256;
constexpr std::size_t kMostLanes = 3 * (1 + kMaxTerms);

}  // namespace

LightFieldRenderer::LightFieldRenderer(const LightField& field, int terms)
    : mesh_((validate(field, "light field"), field.base.mesh)),
      scene_(mesh_),
      uv_(field.base.uv),
      nodes_(field.nodes),
      slot_(field.slot),
      terms_(std::min(field.terms.size(), std::size_t(std::max(terms, 0)))),
      adds_base_(field.adds_base),
      width_(field.base.texture.width()),
      height_(field.base.texture.height()) {
  for (auto& corners : uv_)
    for (auto& uv : corners) uv = uv.cwiseProduct(Eigen::Vector2f(float(width_), float(height_)));
  const std::size_t slots = terms_ ? field.terms[0].surface.size() : 0;
  stride_ = 3 * (1 + slots * terms_);
  maps_.resize(stride_ * std::size_t(width_) * std::size_t(height_));
  const auto place = [&](const Image& map, std::size_t at) {
    for (int y = 0; y < height_; ++y) {
      const std::uint8_t* from = map.row<std::uint8_t>(y);
      std::uint8_t* to = &maps_[stride_ * std::size_t(y) * std::size_t(width_) + at];
      for (int x = 0; x < width_; ++x, from += 3, to += stride_) std::copy_n(from, 3, to);
    }
  };
  place(field.base.texture, 0);
  for (std::size_t s = 0; s < slots; ++s)
    for (std::size_t k = 0; k < terms_; ++k) place(field.terms[k].surface[s], 3 * (1 + s * terms_ + k));

  const std::size_t vertices = mesh_.vertices.size();
  view_.resize(vertices * nodes_.size() * terms_);
  for (std::size_t k = 0; k < terms_; ++k) {
    const LightFieldTerm& term = field.terms[k];
    map_scales_.push_back(term.surface_scale);
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (std::size_t v = 0; v < vertices; ++v)
        view_[(v * nodes_.size() + i) * terms_ + k] =
            term.view_scale.scale * float(term.view[i * vertices + v]) / 255 + term.view_scale.offset;
  }
}

std::vector<float> LightFieldRenderer::view_values(const Eigen::Vector3f& eye, Job& job) const {
  const std::size_t vertices = mesh_.vertices.size();
  std::vector<float> out(vertices * terms_, 0);
  if (terms_ == 0) return out;
  parallel_chunks(job, vertices, kVerticesAtOnce, [&](std::size_t first, std::size_t last) {
    for (std::size_t v = first; v < last; ++v) {
      const NodeWeights w = node_weights(nodes_, mesh_.vertices[v], eye);
      for (int i = 0; i < kNodesBlended; ++i) {
        const float* at = &view_[(v * nodes_.size() + w.node[i]) * terms_];
        for (std::size_t k = 0; k < terms_; ++k) out[v * terms_ + k] += w.weight[i] * at[k];
      }
    }
  });
  return out;
}

Rendering LightFieldRenderer::render(const View& view, const RenderOptions& options, Job& job) const {
  const std::vector<float> values = view_values(view.center().cast<float>(), job);
  const std::size_t common = 3 * (1 + terms_);
  return render_with(view, options, scene_, mesh_, job, [&](const SurfaceSample& s) {
    const auto& uv = uv_[s.hit.triangle];
    const auto& t = mesh_.triangles[s.hit.triangle];
    const Eigen::Vector2f at = uv[0] + s.hit.b1 * (uv[1] - uv[0]) + s.hit.b2 * (uv[2] - uv[0]);
    const float x = std::clamp(at.x() - 0.5f, 0.0f, float(width_ - 1)),
                y = std::clamp(at.y() - 0.5f, 0.0f, float(height_ - 1));
    const int x0 = std::min(int(x), std::max(width_ - 2, 0)), y0 = std::min(int(y), std::max(height_ - 2, 0));
    const std::size_t right = width_ > 1 ? stride_ : 0, down = height_ > 1 ? stride_ * std::size_t(width_) : 0;
    const float fx = x - float(x0), fy = y - float(y0);
    const std::uint8_t* texel = &maps_[stride_ * (std::size_t(y0) * std::size_t(width_) + std::size_t(x0))];
    const float weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
    const std::uint8_t* const corners[4] = {texel, texel + right, texel + down, texel + right + down};
    float color[3] = {0, 0, 0};
    const auto add = [&](std::size_t lane, const float* shares, const float* coefficients) {
      float lanes[kMostLanes];
      const std::size_t n = 3 * terms_;
      for (std::size_t i = 0; i < n; ++i)
        lanes[i] = weights[0] * corners[0][lane + i] + weights[1] * corners[1][lane + i] +
                   weights[2] * corners[2][lane + i] + weights[3] * corners[3][lane + i];
      for (std::size_t k = 0; k < terms_; ++k) {
        const float c = coefficients[k] * shares[0];
        const ByteScale& m = map_scales_[k];
        for (int ch = 0; ch < 3; ++ch) color[ch] += c * (m.scale / 255 * lanes[3 * k + ch] + m.offset);
      }
    };
    if (adds_base_)
      for (int ch = 0; ch < 3; ++ch)
        color[ch] = (weights[0] * corners[0][ch] + weights[1] * corners[1][ch] + weights[2] * corners[2][ch] +
                     weights[3] * corners[3][ch]) /
                    255;
    const float share[3] = {1 - s.hit.b1 - s.hit.b2, s.hit.b1, s.hit.b2}, whole = 1;
    if (terms_ && slot_.empty()) {
      float coefficients[kMaxTerms];
      for (std::size_t k = 0; k < terms_; ++k)
        coefficients[k] = share[0] * values[t[0] * terms_ + k] + share[1] * values[t[1] * terms_ + k] +
                          share[2] * values[t[2] * terms_ + k];
      add(3, &whole, coefficients);
    } else if (terms_) {
      for (int j = 0; j < 3; ++j) add(3 * (1 + slot_[t[j]] * terms_), &whole, &values[t[j] * terms_]);
    }
    (void)common;
    return BlendColor{color[0], color[1], color[2], 1};
  });
}

}  // namespace lumihull::slf
