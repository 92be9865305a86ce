#include <lumihull/base/parallel.h>

#include <algorithm>
#include <array>

#include "joint_fit.h"

namespace lumihull::slf {
namespace {

constexpr std::size_t kEveryBlock = 4;            // of so many blocks of texels one is looked at
constexpr double kNoiseShare = 0.3, kSure = 0.6;  // shares at which a term is dropped, or kept whole
constexpr double kVisible = 0.5 / 255;            // root mean square of what holds of a term, below which it is dropped

/// The s within 0 … 1 that minimise s·N s - 2 r·s, by coordinate descent: the problem is convex. Where N has nothing:
/// 0.
Eigen::VectorXd bounded_least_squares(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right) {
  Eigen::VectorXd s = Eigen::VectorXd::Zero(right.size());
  for (int sweep = 0; sweep < 200; ++sweep)
    for (Eigen::Index i = 0; i < s.size(); ++i)
      if (normal(i, i) > 0) s[i] = std::clamp(s[i] + (right[i] - normal.row(i).dot(s)) / normal(i, i), 0.0, 1.0);
  return s;
}

}  // namespace

/// How much of each term holds at photographs that had no part in it. By folds, view maps at the left-out photographs
/// come from the others' by way of the nodes; mean colour and surface maps of some texels are fitted to the others'
/// samples; then s minimises Σ w |c - T - Σ s_k g_k f_k|² over the left-out samples. On a matt object the terms are
/// noise, s comes out near 0, and such terms are dropped: between the photographs they would only do harm. Terms that
/// hold come out below 1, too, because folds are farther from the other photographs than new views are; so from kSure
/// on they stay as they are. Shares alone do not tell what is worth keeping: how a matt object's photographs blur it,
/// each by its own foreshortening, holds at others, too, but whoever renders blurs anew. That is little: what changes
/// the samples by less than half a byte is dropped.
void JointFit::cross_validate(Job& job) {
  const auto k = std::ptrdiff_t(terms_);
  const std::size_t size = nodes_.size() * terms_, folds = std::min(kFolds, at_node_.size());
  std::vector<std::vector<float>> predicted(at_node_.size());
  for (auto& views : predicted) views.assign(vertices_ * terms_, 0);
  parallel_chunks(job, vertices_, kVerticesAtOnce, [&](std::size_t first, std::size_t last) {
    NodeRegression regression(laplacian_, options_.view_smoothness, terms_);
    std::vector<float> values(size);
    for (std::size_t v = first; v < last; ++v)
      for (std::size_t fold = 0; fold < folds; ++fold) {
        regress(v, regression, fold, values);
        for (std::size_t i = fold; i < at_node_.size(); i += kFolds)
          blend_nodes(weights_[at_node_[i]][v], values, {&predicted[i][v * terms_], terms_});
      }
  });

  const std::size_t chunks = (blocks_ + kEveryBlock * kBlocksAtOnce - 1) / (kEveryBlock * kBlocksAtOnce);
  std::vector<Eigen::MatrixXd> normals(chunks, Eigen::MatrixXd::Zero(k, k));
  std::vector<Eigen::VectorXd> rights(chunks, Eigen::VectorXd::Zero(k));
  std::vector<double> weights(chunks, 0);
  std::vector<double> squares(chunks, 0);
  parallel_for(job, chunks, [&](std::size_t chunk) {
    TexelFit fit(terms_, options_.surface_ridge);
    std::vector<float> means, surfaces, view(terms_);
    Eigen::Matrix<float, 3, Eigen::Dynamic> part(3, k);
    const std::size_t stop = std::min(blocks_, (chunk + 1) * kEveryBlock * kBlocksAtOnce);
    for (std::size_t b = chunk * kEveryBlock * kBlocksAtOnce; b < stop; b += kEveryBlock) {
      const std::uint32_t begin = atlas_.blocks[b], count = atlas_.blocks[b + 1] - begin;
      for (std::size_t fold = 0; fold < folds; ++fold) {
        fit.clear(count);
        for (std::size_t i = 0; i < at_node_.size(); ++i)
          if (i % kFolds != fold) add_samples(fit, b, at_node_[i]);
        means.assign(count * 3, 0), surfaces.assign(count * terms_ * 3, 0);
        for (std::size_t i = 0; i < count; ++i) fit.solve(i, &means[i * 3], &surfaces[i * terms_ * 3]);
        for (std::size_t left_out = fold; left_out < at_node_.size(); left_out += kFolds) {
          const std::size_t p = at_node_[left_out];
          if (photos_[p].first[b] == kUnseen) continue;
          const SurfaceSample8* samples = &photos_[p].samples[photos_[p].first[b]];
          for (std::size_t i = 0; i < count; ++i) {
            const float w = samples[i].weight();
            if (w == 0 || fit.weight(i) == 0) continue;
            interpolate(predicted[left_out], atlas_.texels[begin + i], view.data());
            const Eigen::Map<const Eigen::Matrix<float, 3, Eigen::Dynamic>> g(&surfaces[i * terms_ * 3], 3, k);
            part = g * Eigen::Map<const Eigen::VectorXf>(view.data(), k).asDiagonal();
            const std::array<float, 3> c = color_of(samples[i]);
            const Eigen::Vector3f left =
                Eigen::Map<const Eigen::Vector3f>(c.data()) - Eigen::Map<const Eigen::Vector3f>(&means[i * 3]);
            normals[chunk] += (w * (part.transpose() * part)).cast<double>();
            rights[chunk] += (w * (part.transpose() * left)).cast<double>();
            weights[chunk] += 3.0 * w;
            squares[chunk] += double(w * left.squaredNorm());
          }
        }
      }
    }
  });
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(k);
  double weight = 0, square = 0;
  for (std::size_t i = 0; i < chunks; ++i)
    normal += normals[i], right += rights[i], weight += weights[i], square += squares[i];
  const Eigen::VectorXd s = bounded_least_squares(normal, right);
  held_ = square > 0 ? (2 * right.dot(s) - s.dot(normal * s)) / square : 0;
  share_.clear();
  for (std::ptrdiff_t i = 0; i < k; ++i) {
    const bool visible = s[i] * s[i] * normal(i, i) >= kVisible * kVisible * weight;
    share_.push_back(visible ? float(std::clamp((s[i] - kNoiseShare) / (kSure - kNoiseShare), 0.0, 1.0)) : 0);
  }
}

}  // namespace lumihull::slf
