#include "joint_fit.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "color.h"
#include "view_system.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kBlocksAtOnce = 32, kVerticesAtOnce = 64;
constexpr float kTowardsNodes = 0.05f;  // pulls a photograph's view maps to what the nodes say, in shares of the weight

/// Polynomials of a direction, degree 1 to 3: smooth functions to start from.
void polynomials(const Eigen::Vector3f& d, std::span<float> out) {
  const float x = d.x(), y = d.y(), z = d.z();
  const std::array<float, kMaxStartTerms> all{x,
                                              y,
                                              z,
                                              x * y,
                                              y * z,
                                              z * x,
                                              x * x - y * y,
                                              3 * z * z - 1,
                                              x * (x * x - 3 * y * y),
                                              y * (3 * x * x - y * y),
                                              z * (x * x - y * y),
                                              x * y * z};
  std::copy_n(all.begin(), out.size(), out.begin());
}

}  // namespace

JointFit::JointFit(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
                   std::span<const Eigen::Vector3f> nodes, const JointFitOptions& options)
    : mesh_(mesh),
      atlas_(atlas),
      photos_(photos),
      nodes_(nodes),
      options_(options),
      terms_(std::size_t(options.terms)),
      vertices_(mesh.vertices.size()),
      blocks_(atlas.blocks.size() - 1),
      middle_(0, 0, 0) {
  for (const auto& v : mesh.vertices) middle_ += v / float(vertices_);
  laplacian_ = node_laplacian(nodes, middle_);
}

JointFactors JointFit::run(Job& job) {
  const std::size_t texels = atlas_.texels.size();
  factors_.mean.assign(texels * 3, 0);
  factors_.seen.assign(texels, 0);
  factors_.surface.assign(texels * terms_ * 3, 0);
  factors_.view.assign(vertices_ * nodes_.size() * terms_, 0);
  const auto steps = std::uint64_t(terms_ ? options_.iterations : 0) + 1;
  job.begin("factors", steps);
  if (terms_) start();
  for (int i = 0; terms_ && i < options_.iterations; ++i) {
    fit_surface(job, false);
    normalise();
    fit_views(job);
    fit_nodes(job);
    evaluate_nodes(job);
    job.advance();
  }
  fit_surface(job, true);
  if (terms_) normalise();
  job.advance();
  job.end();
  return std::move(factors_);
}

void JointFit::start() {
  const ViewSystem::Edges edges(mesh_);
  edges_of_ = edges.of_triangle;
  edges_ = edges.vertices;
  weights_.resize(photos_.size());
  views_.resize(photos_.size());
  trust_.resize(photos_.size());
  for (std::size_t p = 0; p < photos_.size(); ++p) {
    weights_[p].resize(vertices_);
    views_[p].resize(vertices_ * terms_);
    trust_[p].assign(vertices_, 0);
    for (std::size_t v = 0; v < vertices_; ++v) {
      weights_[p][v] = node_weights(nodes_, mesh_.vertices[v], photos_[p].center);
      polynomials((photos_[p].center - mesh_.vertices[v]).normalized(), {view_at(p, v), terms_});
    }
  }
  for (std::size_t v = 0; v < vertices_; ++v)
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      polynomials((nodes_[i] - mesh_.vertices[v]).normalized(),
                  {&factors_.view[(v * nodes_.size() + i) * terms_], terms_});
}

/// View maps at the photographs from the values at the nodes.
void JointFit::evaluate_nodes(Job& job) {
  parallel_for(job, photos_.size(), [&](std::size_t p) {
    for (std::size_t v = 0; v < vertices_; ++v) {
      float* out = view_at(p, v);
      std::fill_n(out, terms_, 0.0f);
      const NodeWeights& w = weights_[p][v];
      for (int i = 0; i < kNodesBlended; ++i) {
        if (w.weight[i] == 0) continue;
        const float* at = &factors_.view[(v * nodes_.size() + w.node[i]) * terms_];
        for (std::size_t k = 0; k < terms_; ++k) out[k] += w.weight[i] * at[k];
      }
    }
  });
}

/// Mean colour and surface maps of every texel: ridge regression on the view maps, exact.
void JointFit::fit_surface(Job& job, bool with_rms) {
  const std::size_t n = terms_ + 1, triangle_size = n * (n + 1) / 2;
  struct Sums {
    double with = 0, mean = 0, weight = 0;
  };
  const std::size_t chunks = (blocks_ + kBlocksAtOnce - 1) / kBlocksAtOnce;
  std::vector<Sums> sums(chunks);
  parallel_for(job, chunks, [&](std::size_t chunk) {
    std::vector<float> normal, right, squares, phi(n);
    Eigen::MatrixXf system(n, n);
    Eigen::MatrixXf colors(n, 3);
    for (std::size_t b = chunk * kBlocksAtOnce; b < std::min(blocks_, (chunk + 1) * kBlocksAtOnce); ++b) {
      const std::uint32_t begin = atlas_.blocks[b], count = atlas_.blocks[b + 1] - begin;
      normal.assign(count * triangle_size, 0);
      right.assign(count * n * 3, 0);
      squares.assign(count, 0);
      for (std::size_t p = 0; p < photos_.size(); ++p) {
        if (photos_[p].first[b] == kUnseen) continue;
        const SurfaceSample8* samples = &photos_[p].samples[photos_[p].first[b]];
        for (std::uint32_t i = 0; i < count; ++i) {
          const float w = samples[i].weight();
          if (w == 0) continue;
          const Texel& texel = atlas_.texels[begin + i];
          const auto& t = mesh_.triangles[texel.triangle];
          phi[0] = 1;
          if (terms_) {
            const float *a0 = view_at(p, t[0]), *a1 = view_at(p, t[1]), *a2 = view_at(p, t[2]);
            const float b0 = 1 - texel.b1 - texel.b2;
            for (std::size_t k = 0; k < terms_; ++k) phi[k + 1] = b0 * a0[k] + texel.b1 * a1[k] + texel.b2 * a2[k];
          }
          const std::array<float, 3> c{unit_of_srgb8(samples[i].r), unit_of_srgb8(samples[i].g),
                                       unit_of_srgb8(samples[i].b)};
          float* at = &normal[i * triangle_size];
          float* rhs = &right[i * n * 3];
          for (std::size_t k = 0; k < n; ++k) {
            const float wk = w * phi[k];
            for (std::size_t l = 0; l <= k; ++l) *at++ += wk * phi[l];
            for (std::size_t ch = 0; ch < 3; ++ch) *rhs++ += wk * c[ch];
          }
          squares[i] += w * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
        }
      }
      for (std::uint32_t i = 0; i < count; ++i) {
        const float* at = &normal[i * triangle_size];
        const float weight = at[0];
        const std::size_t texel = begin + i;
        factors_.seen[texel] = weight;
        if (weight == 0) {
          std::fill_n(&factors_.mean[texel * 3], 3, 0.0f);
          std::fill_n(factors_.surface.begin() + std::ptrdiff_t(texel * terms_ * 3), terms_ * 3, 0.0f);
          continue;
        }
        for (std::size_t k = 0; k < n; ++k)
          for (std::size_t l = 0; l <= k; ++l) system(std::ptrdiff_t(k), std::ptrdiff_t(l)) = *at++;
        const float ridge = float(options_.surface_ridge) * weight;
        for (std::size_t k = 1; k < n; ++k) system(std::ptrdiff_t(k), std::ptrdiff_t(k)) += ridge;
        for (std::size_t k = 0; k < n; ++k)
          for (std::size_t ch = 0; ch < 3; ++ch)
            colors(std::ptrdiff_t(k), std::ptrdiff_t(ch)) = right[(i * n + k) * 3 + ch];
        const Eigen::MatrixXf rhs = colors;
        system.selfadjointView<Eigen::Lower>().llt().solveInPlace(colors);
        for (std::size_t ch = 0; ch < 3; ++ch) {
          factors_.mean[texel * 3 + ch] = colors(0, std::ptrdiff_t(ch));
          for (std::size_t k = 0; k < terms_; ++k)
            factors_.surface[(texel * terms_ + k) * 3 + ch] = colors(std::ptrdiff_t(k + 1), std::ptrdiff_t(ch));
        }
        if (with_rms) {
          // |c - φx|² = |c|² - 2 x·r + x·N x, with (N + ridge) x = r.
          double left = squares[i];
          for (std::size_t ch = 0; ch < 3; ++ch) {
            const auto x = colors.col(std::ptrdiff_t(ch));
            left -= double(x.dot(rhs.col(std::ptrdiff_t(ch)))) +
                    double(ridge) * x.tail(std::ptrdiff_t(terms_)).squaredNorm();
          }
          sums[chunk].with += std::max(0.0, left);
          sums[chunk].mean += std::max(0.0, double(squares[i]) - double(rhs.row(0).squaredNorm()) / weight);
          sums[chunk].weight += 3.0 * weight;
        }
      }
    }
  });
  if (!with_rms) return;
  Sums all;
  for (const Sums& s : sums) all.with += s.with, all.mean += s.mean, all.weight += s.weight;
  rms = all.weight > 0 ? std::sqrt(all.with / all.weight) : 0;
  rms_of_mean = all.weight > 0 ? std::sqrt(all.mean / all.weight) : 0;
}

void JointFit::fit_views(Job& job) {
  parallel_for(job, photos_.size(), [&](std::size_t p) { fit_view(p); });
}

/// The view maps of all vertices at one photograph: they are coupled where they share triangles.
void JointFit::fit_view(std::size_t p) {
  ViewSystem system(terms_, vertices_, edges_);
  std::vector<float> gram(terms_ * (terms_ + 1) / 2), right(terms_);
  for (std::size_t b = 0; b < blocks_; ++b) {
    if (photos_[p].first[b] == kUnseen) continue;
    const SurfaceSample8* samples = &photos_[p].samples[photos_[p].first[b]];
    for (std::uint32_t texel = atlas_.blocks[b]; texel < atlas_.blocks[b + 1]; ++texel, ++samples) {
      const float w = samples->weight();
      if (w == 0) continue;
      const float* g = &factors_.surface[std::size_t(texel) * terms_ * 3];
      const float* mean = &factors_.mean[std::size_t(texel) * 3];
      const std::array<float, 3> r{w * (unit_of_srgb8(samples->r) - mean[0]), w * (unit_of_srgb8(samples->g) - mean[1]),
                                   w * (unit_of_srgb8(samples->b) - mean[2])};
      float* at = gram.data();
      for (std::size_t k = 0; k < terms_; ++k) {
        const float *gk = g + 3 * k, wk[3] = {w * gk[0], w * gk[1], w * gk[2]};
        for (std::size_t l = 0; l <= k; ++l) *at++ = wk[0] * g[3 * l] + wk[1] * g[3 * l + 1] + wk[2] * g[3 * l + 2];
        right[k] = r[0] * gk[0] + r[1] * gk[1] + r[2] * gk[2];
      }
      const Texel& t = atlas_.texels[texel];
      system.add(mesh_.triangles[t.triangle], edges_of_[t.triangle], {1 - t.b1 - t.b2, t.b1, t.b2}, gram, right);
    }
  }
  trust_[p] = system.trust();
  system.solve(views_[p], kTowardsNodes);
}

/// The values at the nodes that agree best with the view maps found at the photographs, weighted by what is behind
/// these.
void JointFit::fit_nodes(Job& job) {
  const std::size_t size = nodes_.size() * terms_;
  parallel_chunks(job, vertices_, kVerticesAtOnce, [&](std::size_t first, std::size_t last) {
    NodeRegression regression(laplacian_, options_.view_smoothness, terms_);
    for (std::size_t v = first; v < last; ++v) {
      regression.clear();
      for (std::size_t p = 0; p < photos_.size(); ++p)
        if (trust_[p][v] > 0) regression.add(weights_[p][v], trust_[p][v], {view_at(p, v), terms_});
      regression.solve({&factors_.view[v * size], size});
    }
  });
}

/// View maps and surface maps are only known up to an invertible matrix: G H = (G M⁻¹)(M H). It is chosen so that view
/// maps are uncorrelated with mean square 1 and surface maps orthogonal, in falling order: principal components.
void JointFit::normalise() {
  const auto k = std::ptrdiff_t(terms_);
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(k, k), g = Eigen::MatrixXd::Zero(k, k);
  double count = 0;
  for (std::size_t p = 0; p < photos_.size(); ++p)
    for (std::size_t v = 0; v < vertices_; ++v) {
      if (!(trust_[p][v] > 0)) continue;
      const Eigen::Map<const Eigen::VectorXf> a(view_at(p, v), k);
      h += (a * a.transpose()).cast<double>();
      ++count;
    }
  if (count > 0)
    h /= count;
  else
    h.setIdentity();
  const std::size_t texels = atlas_.texels.size();
  for (std::size_t i = 0; i < texels; ++i) {
    const Eigen::Map<const RowMajor> a(&factors_.surface[i * terms_ * 3], k, 3);
    g += (factors_.seen[i] * (a * a.transpose())).cast<double>();
  }
  // With h = L Lᵀ the maps L⁻¹ a are white; g becomes Lᵀ g L, whose eigenvectors are the axes.
  h.diagonal().array() += 1e-9 * h.trace() / double(k) + 1e-30;
  const Eigen::MatrixXd l = h.llt().matrixL();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(l.transpose() * g * l);
  Eigen::MatrixXd axes = eigen.eigenvectors().rowwise().reverse();  // falling
  for (std::ptrdiff_t i = 0; i < k; ++i) {
    std::ptrdiff_t most;
    axes.col(i).cwiseAbs().maxCoeff(&most);
    if (axes(most, i) < 0) axes.col(i) *= -1;
  }
  const Eigen::MatrixXf to_view =
      (axes.transpose() * l.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(k, k))).cast<float>();
  const Eigen::MatrixXf to_surface = (axes.transpose() * l.transpose()).cast<float>();
  const auto turn = [&](float* at) {
    Eigen::Map<Eigen::VectorXf> a(at, k);
    a = (to_view * a).eval();
  };
  for (auto& views : views_)
    for (std::size_t v = 0; v < vertices_; ++v) turn(&views[v * terms_]);
  for (std::size_t i = 0; i < vertices_ * nodes_.size(); ++i) turn(&factors_.view[i * terms_]);
  for (std::size_t i = 0; i < texels; ++i) {
    Eigen::Map<RowMajor> a(&factors_.surface[i * terms_ * 3], k, 3);
    a = (to_surface * a).eval();
  }
}

}  // namespace lumihull::slf
