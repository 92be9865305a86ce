#include "ring_fit.h"

#include <lumihull/base/parallel.h>
#include <lumihull/slf/factorization.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "view_nodes.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kVerticesAtOnce = 16;
constexpr float kWhole = 0.9f;           // share of a ring that a photograph must see
constexpr std::size_t kFewestViews = 3;  // that a ring's factors are made of
constexpr float kHoleWeight = 0.01f;     // of the mean colour where a photograph sees nothing (non-negative)
constexpr std::uint64_t kSeed = 1;       // of all rings: neighbours that look alike get factors that do
constexpr float kRounding = 0.5f / 255;  // root mean square error that photographs' bytes have anyway
constexpr int kNonNegativeIterations = 100;
constexpr double kNonNegativeTolerance = 1e-4;

std::array<float, 3> rgb(const BlendColor& c) { return {c.r, c.g, c.b}; }
std::array<float, 3> rgb(const SurfaceSample8& s) {
  return {unit_of_srgb8(s.r), unit_of_srgb8(s.g), unit_of_srgb8(s.b)};
}

class RingFit {
 public:
  RingFit(const hull::Mesh& mesh, const Atlas& atlas, const Rings& rings, std::span<const PhotoSamples> photos,
          std::span<const Eigen::Vector3f> nodes, std::span<const BlendColor> colors, const RingFitOptions& options)
      : mesh_(mesh),
        atlas_(atlas),
        rings_(rings),
        photos_(photos),
        nodes_(nodes),
        colors_(colors),
        options_(options),
        terms_(std::size_t(options.terms)) {
    Eigen::Vector3f middle(0, 0, 0);
    for (const auto& v : mesh.vertices) middle += v / float(mesh.vertices.size());
    laplacian_ = node_laplacian(nodes, middle);
    block_.resize(atlas.texels.size());
    for (std::uint32_t b = 0; b + 1 < atlas.blocks.size(); ++b)
      std::fill(block_.begin() + atlas.blocks[b], block_.begin() + atlas.blocks[b + 1], b);
  }

  RingFactors run(Job& job) {
    RingFactors out;
    out.surface.assign(rings_.texels.size() * terms_ * 3, 0);
    out.view.assign(mesh_.vertices.size() * nodes_.size() * terms_, 0);
    job.begin("rings", mesh_.vertices.size() + photos_.size());
    parallel_chunks(
        job, mesh_.vertices.size(), kVerticesAtOnce,
        [&](std::size_t first, std::size_t last) {
          NodeRegression regression(laplacian_, options_.view_smoothness, terms_);
          for (std::size_t v = first; v < last; ++v) fit(v, regression, out);
        },
        true);
    measure(out, job);
    job.end();
    return out;
  }

 private:
  /// A photograph that sees a ring, and how well.
  struct Column {
    std::size_t photo;
    float weight;
  };

  /// The photograph's sample of a texel; null where it doesn't see it.
  const SurfaceSample8* sample(std::size_t photo, std::uint32_t texel) const {
    const PhotoSamples& p = photos_[photo];
    const std::uint32_t block = block_[texel];
    if (p.first[block] == kUnseen) return nullptr;
    const SurfaceSample8& s = p.samples[p.first[block] + texel - atlas_.blocks[block]];
    return s.root_weight ? &s : nullptr;
  }

  /// The photographs that see (nearly) all of a ring.
  std::vector<Column> columns_of(std::span<const RingTexel> ring) const {
    float whole = 0;
    for (const RingTexel& r : ring) whole += r.share * r.share;
    std::vector<Column> columns;
    for (std::size_t p = 0; p < photos_.size(); ++p) {
      float seen = 0, weight = 0;
      for (const RingTexel& r : ring)
        if (const SurfaceSample8* s = sample(p, r.texel)) {
          const float square = r.share * r.share;
          seen += square, weight += square * s->weight();
        }
      if (seen > 0 && seen >= kWhole * whole) columns.push_back({p, weight / whole});
    }
    return columns;
  }

  /// Writes the ring's part of `out`.
  void fit(std::size_t v, NodeRegression& regression, RingFactors& out) const {
    const std::span<const RingTexel> ring = rings_.of(v);
    const std::span<float> surface(&out.surface[rings_.first[v] * terms_ * 3], ring.size() * terms_ * 3);
    const std::span<float> view(&out.view[v * nodes_.size() * terms_], nodes_.size() * terms_);
    const std::vector<Column> columns = ring.empty() ? std::vector<Column>() : columns_of(ring);
    if (columns.size() < kFewestViews) {
      if (options_.non_negative) use_mean(ring, surface, view);
      return;
    }
    Factors factors = options_.non_negative ? factor_colors(ring, columns) : factor_residual(ring, columns);
    const Eigen::VectorXf middle = normalise(columns, factors);
    for (std::size_t i = 0; i < ring.size(); ++i)
      for (std::size_t k = 0; k < terms_; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          surface[(i * terms_ + k) * 3 + c] =
              factors.surface(std::ptrdiff_t(3 * i + c), std::ptrdiff_t(k)) / ring[i].share;

    regression.clear();
    factors.view.colwise() -= middle;
    for (std::size_t m = 0; m < columns.size(); ++m)
      regression.add(node_weights(nodes_, mesh_.vertices[v], photos_[columns[m].photo].center), columns[m].weight,
                     {factors.view.col(std::ptrdiff_t(m)).data(), terms_});
    regression.solve(view);
    if (options_.non_negative)
      for (std::size_t i = 0; i < view.size(); ++i)
        view[i] = std::max(0.0f, view[i] + middle[std::ptrdiff_t(i % terms_)]);
  }

  /// One term that shows the mean colour from everywhere.
  void use_mean(std::span<const RingTexel> ring, std::span<float> surface, std::span<float> view) const {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const auto mean = rgb(colors_[ring[i].texel]);
      for (std::size_t c = 0; c < 3; ++c) surface[i * terms_ * 3 + c] = mean[c];
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) view[i * terms_] = 1;
  }

  Factors factor_residual(std::span<const RingTexel> ring, const std::vector<Column>& columns) const {
    Eigen::MatrixXf a = Eigen::MatrixXf::Zero(std::ptrdiff_t(3 * ring.size()), std::ptrdiff_t(columns.size()));
    Eigen::VectorXf root(a.cols());
    for (std::ptrdiff_t m = 0; m < a.cols(); ++m) {
      const Column& column = columns[std::size_t(m)];
      root[m] = std::sqrt(column.weight);
      for (std::size_t i = 0; i < ring.size(); ++i)
        if (const SurfaceSample8* s = sample(column.photo, ring[i].texel)) {
          const auto color = rgb(*s), mean = rgb(colors_[ring[i].texel]);
          for (std::size_t c = 0; c < 3; ++c)
            a(std::ptrdiff_t(3 * i + c), m) = root[m] * ring[i].share * (color[c] - mean[c]);
        }
    }
    Factors factors = pca(a, options_.terms, kSeed);
    for (std::ptrdiff_t m = 0; m < a.cols(); ++m) factors.view.col(m) /= root[m];
    return factors;
  }

  Factors factor_colors(std::span<const RingTexel> ring, const std::vector<Column>& columns) const {
    Eigen::MatrixXf a(std::ptrdiff_t(3 * ring.size()), std::ptrdiff_t(columns.size())), weights(a.rows(), a.cols());
    double whole = 0;  // what errors of 1 would cost
    for (std::ptrdiff_t m = 0; m < a.cols(); ++m) {
      const Column& column = columns[std::size_t(m)];
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const SurfaceSample8* s = sample(column.photo, ring[i].texel);
        const auto color = s ? rgb(*s) : rgb(colors_[ring[i].texel]);
        for (std::size_t c = 0; c < 3; ++c) {
          a(std::ptrdiff_t(3 * i + c), m) = ring[i].share * std::max(0.0f, color[c]);
          const float w = weights(std::ptrdiff_t(3 * i + c), m) = s ? s->weight() : kHoleWeight * column.weight;
          whole += double(w) * ring[i].share * ring[i].share;
        }
      }
    }
    // Where one term does, more would share the ring's colour out between them at random, each ring in its own way.
    const NmfOptions how{kNonNegativeIterations, kNonNegativeTolerance, &weights};
    std::vector<double> loss;
    Factors one = nmf(a, 1, how, kSeed, &loss);
    if (options_.terms == 1) return one;
    if (loss.back() > kRounding * kRounding * whole) return nmf(a, options_.terms, how, kSeed);
    Factors padded{Eigen::MatrixXf::Zero(a.rows(), options_.terms), Eigen::MatrixXf::Zero(options_.terms, a.cols())};
    padded.surface.col(0) = one.surface;
    padded.view.row(0) = one.view;
    return padded;
  }

  /// Scales view maps to unit mean square (signed) or mean 1 (non-negative), surface maps inversely. Returns what view
  /// maps are far from all photographs.
  Eigen::VectorXf normalise(const std::vector<Column>& columns, Factors& factors) const {
    Eigen::VectorXf middle = Eigen::VectorXf::Zero(std::ptrdiff_t(terms_));
    for (std::ptrdiff_t k = 0; k < middle.size(); ++k) {
      float sum = 0, all = 0;
      for (std::ptrdiff_t m = 0; m < factors.view.cols(); ++m) {
        const float w = columns[std::size_t(m)].weight, h = factors.view(k, m);
        sum += w * (options_.non_negative ? h : h * h), all += w;
      }
      const float size = options_.non_negative ? sum / all : std::sqrt(sum / all);
      if (!(size > 0)) continue;
      factors.view.row(k) /= size;
      factors.surface.col(k) *= size;
      if (options_.non_negative) middle[k] = 1;
    }
    return middle;
  }

  /// Root mean square of what is left of the samples.
  void measure(RingFactors& out, Job& job) const {
    struct Sums {
      double left = 0, weight = 0;
    };
    std::vector<Sums> sums(photos_.size());
    parallel_for(
        job, photos_.size(),
        [&](std::size_t p) {
          const std::vector<float> view = view_at(out.view, photos_[p].center);
          for (std::uint32_t i = 0; i < atlas_.texels.size(); ++i) {
            const SurfaceSample8* s = sample(p, i);
            if (!s) continue;
            std::array<float, 3> left = rgb(*s);
            if (!options_.non_negative) {
              const auto mean = rgb(colors_[i]);
              for (std::size_t c = 0; c < 3; ++c) left[c] -= mean[c];
            }
            const Texel& texel = atlas_.texels[i];
            const auto& corners = mesh_.triangles[texel.triangle];
            const std::array<float, 3> hat{1 - texel.b1 - texel.b2, texel.b1, texel.b2};
            for (std::size_t j = 0; j < 3; ++j) {
              const float* g = &out.surface[rings_.of_texel[i][j] * terms_ * 3];
              const float* h = &view[corners[j] * terms_];
              for (std::size_t k = 0; k < terms_; ++k)
                for (std::size_t c = 0; c < 3; ++c) left[c] -= hat[j] * g[3 * k + c] * h[k];
            }
            for (const float l : left) sums[p].left += double(s->weight()) * l * l;
            sums[p].weight += 3.0 * s->weight();
          }
        },
        true);
    Sums all;
    for (const Sums& s : sums) all.left += s.left, all.weight += s.weight;
    out.rms = all.weight > 0 ? std::sqrt(all.left / all.weight) : 0;
  }

  /// View maps of all vertices for one eye: vertices x terms.
  std::vector<float> view_at(const std::vector<float>& nodes, const Eigen::Vector3f& eye) const {
    std::vector<float> out(mesh_.vertices.size() * terms_, 0);
    const std::size_t size = nodes_.size() * terms_;
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v)
      blend_nodes(node_weights(nodes_, mesh_.vertices[v], eye), {&nodes[v * size], size}, {&out[v * terms_], terms_});
    return out;
  }

  const hull::Mesh& mesh_;
  const Atlas& atlas_;
  const Rings& rings_;
  std::span<const PhotoSamples> photos_;
  std::span<const Eigen::Vector3f> nodes_;
  std::span<const BlendColor> colors_;
  RingFitOptions options_;
  std::size_t terms_;
  Eigen::MatrixXf laplacian_;
  std::vector<std::uint32_t> block_;  // of each texel
};

}  // namespace

RingFactors fit_rings(const hull::Mesh& mesh, const Atlas& atlas, const Rings& rings,
                      std::span<const PhotoSamples> photos, std::span<const Eigen::Vector3f> nodes,
                      std::span<const BlendColor> colors, const RingFitOptions& options, Job& job) {
  return RingFit(mesh, atlas, rings, photos, nodes, colors, options).run(job);
}

}  // namespace lumihull::slf
