#include <lumihull/slf/light_field.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "fit/mirror.h"
#include "fit/view_nodes.h"
#include "render_with.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace lumihull::slf {
namespace {

constexpr std::size_t kVerticesAtOnce = 256;
constexpr std::size_t kLanes = 8;
constexpr std::size_t kMostGroups = (3 * (1 + kMaxTerms) + kLanes - 1) / kLanes;
constexpr std::size_t kMostLanes = kLanes * kMostGroups;

/// A place between four texels.
struct Bilinear {
  const std::uint8_t* corner[4];
  float weight[4];
};

/// out[i] = coefficients[i] (scale[i] byte[i] + offset[i]) with the bytes interpolated, for the lanes of some groups.
void weigh(const Bilinear& at, std::size_t lane, std::size_t groups, const float* scale, const float* offset,
           const float* coefficients, float* out) {
#ifdef __AVX2__
  const auto bytes = [&](int corner, std::size_t i) {
    const __m128i b = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at.corner[corner] + lane + i));
    return _mm256_mul_ps(_mm256_set1_ps(at.weight[corner]), _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(b)));
  };
  for (std::size_t i = 0; i < kLanes * groups; i += kLanes) {
    const __m256 mean = _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(bytes(0, i), bytes(1, i)), bytes(2, i)), bytes(3, i));
    const __m256 value = _mm256_add_ps(_mm256_mul_ps(_mm256_loadu_ps(scale + i), mean), _mm256_loadu_ps(offset + i));
    _mm256_storeu_ps(out + i, _mm256_mul_ps(_mm256_loadu_ps(coefficients + i), value));
  }
#else
  for (std::size_t i = 0; i < kLanes * groups; ++i) {
    const float mean = at.weight[0] * at.corner[0][lane + i] + at.weight[1] * at.corner[1][lane + i] +
                       at.weight[2] * at.corner[2][lane + i] + at.weight[3] * at.corner[3][lane + i];
    out[i] = coefficients[i] * (scale[i] * mean + offset[i]);
  }
#endif
}

/// node_weights for one eye and many points, the same answers: most nodes are left out by a quick look.
class NearNodes {
 public:
  NearNodes(std::span<const Eigen::Vector3f> nodes, const Eigen::Vector3f& eye)
      : nodes_(nodes), eye_(eye), blocks_((nodes.size() + kLanes - 1) / kLanes) {
    for (auto& axis : places_) axis.resize(kLanes * blocks_);
    for (std::size_t i = 0; i < kLanes * blocks_; ++i)
      for (int c = 0; c < 3; ++c) places_[std::size_t(c)][i] = nodes[std::min(i, nodes.size() - 1)][c];
    nearness_.resize(kLanes * blocks_);
  }

  NodeWeights weights(const Eigen::Vector3f& point) {
    const Eigen::Vector3f way = (eye_ - point).stableNormalized();
    const float px = point.x(), py = point.y(), pz = point.z(), wx = way.x(), wy = way.y(), wz = way.z();
    for (std::size_t b = 0; b < blocks_; ++b) {
      const float *x = &places_[0][kLanes * b], *y = &places_[1][kLanes * b], *z = &places_[2][kLanes * b];
      float* out = &nearness_[kLanes * b];
      for (std::size_t i = 0; i < kLanes; ++i) {
        const float dx = x[i] - px, dy = y[i] - py, dz = z[i] - pz;
        const float c = dx * wx + dy * wy + dz * wz;
        out[i] = c * std::abs(c) / (dx * dx + dy * dy + dz * dz);  // of a cosine, which falls with the angle
      }
    }
    std::array<float, kNodesBlended + 1> best;
    best.fill(-2);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      float value = nearness_[i];
      if (value > best.back())
        for (float& b : best)
          if (value > b) std::swap(value, b);
    }
    // Rounding may have changed the order of those that differ by less than this.
    const float least = best.back() - 1e-5f;
    near_.clear(), id_.clear();
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (!(nearness_[i] < least)) near_.push_back(nodes_[i]), id_.push_back(std::uint8_t(i));
    NodeWeights w = node_weights(near_, point, eye_);
    for (int i = 0; i < kNodesBlended; ++i)
      if (w.weight[std::size_t(i)] > 0) w.node[std::size_t(i)] = id_[w.node[std::size_t(i)]];
    return w;
  }

 private:
  std::span<const Eigen::Vector3f> nodes_;
  Eigen::Vector3f eye_;
  std::size_t blocks_;
  std::array<std::vector<float>, 3> places_;
  std::vector<float> nearness_;
  std::vector<Eigen::Vector3f> near_;
  std::vector<std::uint8_t> id_;
};

std::size_t groups_of(std::size_t lanes) { return (lanes + kLanes - 1) / kLanes; }

}  // namespace

LightFieldRenderer::LightFieldRenderer(const LightField& field, int terms)
    : mesh_((validate(field, "light field"), field.base.mesh)),
      scene_(mesh_),
      edges_(std::make_shared<const std::vector<MeshEdge>>(mesh_edges(mesh_))),
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
  maps_.resize(stride_ * std::size_t(width_) * std::size_t(height_) + kMostLanes);  // whole groups are read
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

  if (field.reflection) {
    const LightFieldReflection& r = *field.reflection;
    normals_ = r.normals;
    mirrored_center_ = r.center, mirrored_inverse_radius_ = r.inverse_radius;
    for (const std::uint8_t s : r.strength)
      strength_.push_back(r.strength_scale.scale * float(s) / 255 + r.strength_scale.offset);
    mirrored_light_ = light_of(r);
  }
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
  // Three lanes a term, filled up with zeros.
  const std::size_t vertices = mesh_.vertices.size(), lanes = kLanes * groups_of(3 * terms_);
  std::vector<float> out(vertices * lanes, 0);
  if (terms_ == 0) return out;
  parallel_chunks(job, vertices, kVerticesAtOnce, [&](std::size_t first, std::size_t last) {
    NearNodes near(nodes_, eye);
    for (std::size_t v = first; v < last; ++v) {
      const NodeWeights w = near.weights(mesh_.vertices[v]);
      for (std::size_t k = 0; k < terms_; ++k) {
        float sum = 0;
        for (int i = 0; i < kNodesBlended; ++i)
          sum += w.weight[i] * view_[(v * nodes_.size() + w.node[i]) * terms_ + k];
        std::fill_n(&out[v * lanes + 3 * k], 3, sum);
      }
    }
  });
  return out;
}

Rendering LightFieldRenderer::render(const View& view, const RenderOptions& options, Job& job) const {
  const std::vector<float> values = view_values(view.center().cast<float>(), job);
  const std::size_t groups = groups_of(3 * terms_), lanes = kLanes * groups;
  std::array<float, kMostLanes> scale{}, offset{};
  for (std::size_t k = 0; k < terms_; ++k) {
    std::fill_n(&scale[3 * k], 3, map_scales_[k].scale / 255);
    std::fill_n(&offset[3 * k], 3, map_scales_[k].offset);
  }
  const SphereGrid sphere(std::max(3, int(std::lround(std::sqrt(double(mirrored_light_.size() / 2))))));
  const Surroundings around{mirrored_center_, mirrored_inverse_radius_};
  const Eigen::Vector3f eye = view.center().cast<float>();
  const auto mirror = [&](const SurfaceSample& s, float* color) {
    const auto& t = mesh_.triangles[s.hit.triangle];
    const float strength =
        (1 - s.hit.b1 - s.hit.b2) * strength_[t[0]] + s.hit.b1 * strength_[t[1]] + s.hit.b2 * strength_[t[2]];
    const Eigen::Vector3f light =
        strength * mirrored_light(mirrored_light_, mirror_place(sphere, around, mesh_, normals_, s.hit.triangle,
                                                                s.hit.b1, s.hit.b2, eye));
    for (int c = 0; c < 3; ++c)
      color[c] =
          srgb_from_linear(std::clamp(linear_from_srgb(std::clamp(color[c], 0.0f, 1.0f)) + light[c], 0.0f, 1.0f));
  };
  return render_with(
      view, options, scene_, mesh_, job,
      [&](const SurfaceSample& s) {
        const auto& uv = uv_[s.hit.triangle];
        const auto& t = mesh_.triangles[s.hit.triangle];
        const Eigen::Vector2f place = uv[0] + s.hit.b1 * (uv[1] - uv[0]) + s.hit.b2 * (uv[2] - uv[0]);
        const float x = std::clamp(place.x() - 0.5f, 0.0f, float(width_ - 1)),
                    y = std::clamp(place.y() - 0.5f, 0.0f, float(height_ - 1));
        const int x0 = std::min(int(x), std::max(width_ - 2, 0)), y0 = std::min(int(y), std::max(height_ - 2, 0));
        const std::size_t right = width_ > 1 ? stride_ : 0, down = height_ > 1 ? stride_ * std::size_t(width_) : 0;
        const float fx = x - float(x0), fy = y - float(y0);
        const std::uint8_t* texel = &maps_[stride_ * (std::size_t(y0) * std::size_t(width_) + std::size_t(x0))];
        const Bilinear at{{texel, texel + right, texel + down, texel + right + down},
                          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
        float color[3] = {0, 0, 0};
        if (adds_base_)
          for (int ch = 0; ch < 3; ++ch)
            color[ch] = (at.weight[0] * at.corner[0][ch] + at.weight[1] * at.corner[1][ch] +
                         at.weight[2] * at.corner[2][ch] + at.weight[3] * at.corner[3][ch]) /
                        255;
        float products[kMostLanes];
        const auto add = [&](std::size_t lane, const float* coefficients) {
          weigh(at, lane, groups, scale.data(), offset.data(), coefficients, products);
          for (std::size_t k = 0; k < terms_; ++k)
            for (std::size_t ch = 0; ch < 3; ++ch) color[ch] += products[3 * k + ch];
        };
        const float share[3] = {1 - s.hit.b1 - s.hit.b2, s.hit.b1, s.hit.b2};
        float coefficients[kMostLanes];
        if (terms_ && slot_.empty()) {
          const float *a = &values[t[0] * lanes], *b = &values[t[1] * lanes], *c = &values[t[2] * lanes];
          for (std::size_t g = 0; g < groups; ++g)  // a constant number of turns inside, for the compiler
            for (std::size_t i = kLanes * g; i < kLanes * g + kLanes; ++i)
              coefficients[i] = share[0] * a[i] + share[1] * b[i] + share[2] * c[i];
          add(3, coefficients);
        } else if (terms_) {
          for (int j = 0; j < 3; ++j) {
            const float* a = &values[t[j] * lanes];
            for (std::size_t g = 0; g < groups; ++g)
              for (std::size_t i = kLanes * g; i < kLanes * g + kLanes; ++i) coefficients[i] = share[j] * a[i];
            add(3 * (1 + slot_[t[j]] * terms_), coefficients);
          }
        }
        if (!normals_.empty()) mirror(s, color);
        return BlendColor{color[0], color[1], color[2], 1};
      },
      edges_.get());
}

}  // namespace lumihull::slf
