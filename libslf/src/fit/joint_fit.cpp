#include "joint_fit.h"

#include <lumihull/base/parallel.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "texel_fit.h"
#include "view_system.h"

namespace lumihull::slf {
namespace {

constexpr int kTrialIterations = 3;
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
                   std::span<const Eigen::Vector3f> nodes, std::span<const std::uint32_t> at_node,
                   const JointFitOptions& options)
    : mesh_(mesh),
      atlas_(atlas),
      photos_(photos),
      nodes_(nodes),
      at_node_(at_node),
      options_(options),
      terms_(std::size_t(options.terms)),
      vertices_(mesh.vertices.size()),
      blocks_(atlas.blocks.size() - 1),
      middle_(0, 0, 0) {
  for (const auto& v : mesh.vertices) middle_ += v / float(vertices_);
  laplacian_ = node_laplacian(nodes, middle_);
}

JointFactors JointFit::run(Job& job) {
  job.begin("factors", std::uint64_t(terms_ ? options_.iterations : 0) + 1);
  alternate(options_.iterations, job);
  if (terms_ ? kept() == 0 : options_.mean_alone) normals_ = hull::vertex_normals(mesh_);
  std::vector<std::uint32_t> all(photos_.size());
  std::iota(all.begin(), all.end(), 0u);
  fit_surface(all, job);
  if (terms_) normalise();
  job.advance();
  job.end();
  return std::move(factors_);
}

double JointFit::held(Job& job) {
  const int iterations = std::min(kTrialIterations, options_.iterations);
  job.begin("factors on trial", std::uint64_t(iterations));
  alternate(iterations, job);
  job.end();
  return held_;
}

/// Surface maps and view maps by turns, and in the end which terms hold.
void JointFit::alternate(int iterations, Job& job) {
  const std::size_t texels = atlas_.texels.size();
  factors_.mean.assign(texels * 3, 0);
  factors_.seen.assign(texels, 0);
  factors_.surface.assign(texels * terms_ * 3, 0);
  factors_.view.assign(vertices_ * nodes_.size() * terms_, 0);
  if (!terms_) return;
  start();
  for (int i = 0; i < iterations; ++i) {
    fit_surface(at_node_, job);
    normalise();
    fit_views(job);
    fit_nodes(job);
    if (i + 1 == iterations) cross_validate(job);
    evaluate_nodes(job);
    job.advance();
  }
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

void JointFit::interpolate(const std::vector<float>& views, const Texel& texel, float* out) const {
  const auto& t = mesh_.triangles[texel.triangle];
  const float *a0 = &views[t[0] * terms_], *a1 = &views[t[1] * terms_], *a2 = &views[t[2] * terms_];
  const float b0 = 1 - texel.b1 - texel.b2;
  for (std::size_t k = 0; k < terms_; ++k) out[k] = b0 * a0[k] + texel.b1 * a1[k] + texel.b2 * a2[k];
}

/// View maps at the photographs from the values at the nodes.
void JointFit::evaluate_nodes(Job& job) {
  parallel_for(job, photos_.size(), [&](std::size_t p) {
    for (std::size_t v = 0; v < vertices_; ++v)
      blend_nodes(weights_[p][v], {&factors_.view[v * nodes_.size() * terms_], nodes_.size() * terms_},
                  {view_at(p, v), terms_});
  });
}

void JointFit::add_samples(TexelFit& fit, std::size_t block, std::size_t p) const {
  if (photos_[p].first[block] == kUnseen) return;
  const SurfaceSample8* samples = &photos_[p].samples[photos_[p].first[block]];
  std::array<float, kMaxStartTerms> view;
  const std::uint32_t begin = atlas_.blocks[block], end = atlas_.blocks[block + 1];
  for (std::uint32_t texel = begin; texel < end; ++texel, ++samples) {
    float w = samples->weight();
    if (w == 0) continue;
    if (!normals_.empty()) w *= frontal(atlas_.texels[texel], p);
    if (terms_) interpolate(views_[p], atlas_.texels[texel], view.data());
    fit.add(texel - begin, w, color_of(*samples), {view.data(), terms_});
  }
}

/// What a frontal view counts more in a mean colour that is all there is, for it is sharper: the square of its cosine,
/// on top of the samples' own weight. So the mean texture is weighted, too.
float JointFit::frontal(const Texel& texel, std::size_t photo) const {
  const auto& t = mesh_.triangles[texel.triangle];
  const float b0 = 1 - texel.b1 - texel.b2;
  const auto between = [&](const std::vector<Eigen::Vector3f>& of_vertex) -> Eigen::Vector3f {
    return b0 * of_vertex[t[0]] + texel.b1 * of_vertex[t[1]] + texel.b2 * of_vertex[t[2]];
  };
  const Eigen::Vector3f way = photos_[photo].center - between(mesh_.vertices), normal = between(normals_);
  const float facing = way.dot(normal);
  return facing * facing / std::max(way.squaredNorm() * normal.squaredNorm(), 1e-12f);
}

/// Mean colour and surface maps of every texel.
void JointFit::fit_surface(std::span<const std::uint32_t> photos, Job& job) {
  struct Sums {
    double with = 0, mean = 0, weight = 0;
  };
  const std::size_t chunks = (blocks_ + kBlocksAtOnce - 1) / kBlocksAtOnce;
  std::vector<Sums> sums(chunks);
  parallel_for(job, chunks, [&](std::size_t chunk) {
    TexelFit fit(terms_, options_.surface_ridge, share_);
    for (std::size_t b = chunk * kBlocksAtOnce; b < std::min(blocks_, (chunk + 1) * kBlocksAtOnce); ++b) {
      const std::uint32_t begin = atlas_.blocks[b], end = atlas_.blocks[b + 1];
      fit.clear(end - begin);
      for (const std::uint32_t p : photos) add_samples(fit, b, p);
      for (std::size_t texel = begin; texel < end; ++texel) {
        factors_.seen[texel] = fit.weight(texel - begin);
        fit.solve(texel - begin, &factors_.mean[texel * 3], factors_.surface.data() + texel * terms_ * 3);
        sums[chunk].with += fit.left();
        sums[chunk].mean += fit.left_by_mean();
        sums[chunk].weight += 3.0 * double(fit.weight(texel - begin));
      }
    }
  });
  Sums all;
  for (const Sums& s : sums) all.with += s.with, all.mean += s.mean, all.weight += s.weight;
  rms = all.weight > 0 ? std::sqrt(all.with / all.weight) : 0;
  rms_of_mean = all.weight > 0 ? std::sqrt(all.mean / all.weight) : 0;
}

void JointFit::fit_views(Job& job) {
  parallel_for(job, at_node_.size(), [&](std::size_t i) { fit_view(at_node_[i]); });
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
      const std::array<float, 3> c = color_of(*samples),
                                 r{w * (c[0] - mean[0]), w * (c[1] - mean[1]), w * (c[2] - mean[2])};
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
    for (std::size_t v = first; v < last; ++v) regress(v, regression, kNoFold, {&factors_.view[v * size], size});
  });
}

/// One vertex's values at the nodes, from all photographs but those of one fold. Their mean is taken away from the
/// photographs' values: it is the mean colour's part, so that this stays the mean where terms are left out and where no
/// photograph looks.
void JointFit::regress(std::size_t v, NodeRegression& regression, std::size_t left_out, std::span<float> out) const {
  std::array<float, kMaxStartTerms> mean{}, value{};
  float weight = 0;
  for (std::size_t i = 0; i < at_node_.size(); ++i) {
    const std::size_t p = at_node_[i];
    if (!(trust_[p][v] > 0) || i % kFolds == left_out) continue;
    weight += trust_[p][v];
    for (std::size_t k = 0; k < terms_; ++k) mean[k] += trust_[p][v] * views_[p][v * terms_ + k];
  }
  for (float& m : mean) m = weight > 0 ? m / weight : 0;
  regression.clear();
  for (std::size_t i = 0; i < at_node_.size(); ++i) {
    const std::size_t p = at_node_[i];
    if (!(trust_[p][v] > 0) || i % kFolds == left_out) continue;
    for (std::size_t k = 0; k < terms_; ++k) value[k] = views_[p][v * terms_ + k] - mean[k];
    regression.add(weights_[p][v], trust_[p][v], {value.data(), terms_});
  }
  regression.solve(out);
}

/// View maps and surface maps are only known up to an invertible matrix: G H = (G M⁻¹)(M H). It is chosen so that view
/// maps are uncorrelated with mean square 1 and surface maps orthogonal, in falling order: principal components.
void JointFit::normalise() {
  const auto k = std::ptrdiff_t(terms_);
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(k, k), g = Eigen::MatrixXd::Zero(k, k);
  double count = 0;
  for (const std::uint32_t p : at_node_)
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
