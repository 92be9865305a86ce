#include "view_nodes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lumihull::slf {
namespace {

constexpr float kSamePlace = 0.0017f;  // rad
constexpr int kNeighbours = 4;
constexpr float kTowardsMean = 1e-3f;  // pulls values to 0 where nobody looks, in shares of the ordinary trust

/// Angle between unit vectors, accurate where it is small.
float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return 2 * std::asin(std::min(1.0f, 0.5f * (a - b).norm()));
}

Eigen::Vector3f direction(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  const Eigen::Vector3f way = to - from;
  const float length = way.norm();
  return length > 0 ? Eigen::Vector3f(way / length) : Eigen::Vector3f(0, 0, 1);
}

std::vector<Eigen::Vector3f> directions(std::span<const Eigen::Vector3f> places, const Eigen::Vector3f& center) {
  std::vector<Eigen::Vector3f> out;
  for (const auto& p : places) out.push_back(direction(center, p));
  return out;
}

}  // namespace

NodeWeights node_weights(std::span<const Eigen::Vector3f> nodes, const Eigen::Vector3f& point,
                         const Eigen::Vector3f& eye) {
  // The smallest squared chords; chords order like angles.
  constexpr int kKept = kNodesBlended + 1;
  std::array<float, kKept> nearest;
  std::array<std::uint8_t, kKept> id{};
  nearest.fill(std::numeric_limits<float>::infinity());
  const Eigen::Vector3f d = direction(point, eye);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const float chord2 = (direction(point, nodes[i]) - d).squaredNorm();
    if (chord2 >= nearest[kKept - 1]) continue;
    int at = kKept - 1;
    for (; at > 0 && nearest[at - 1] > chord2; --at) nearest[at] = nearest[at - 1], id[at] = id[at - 1];
    nearest[at] = chord2, id[at] = std::uint8_t(i);
  }
  NodeWeights out;
  const int count = std::min<int>(kNodesBlended, int(nodes.size()));
  const auto angle = [](float chord2) { return 2 * std::asin(std::min(1.0f, 0.5f * std::sqrt(chord2))); };
  const float farthest = std::isfinite(nearest[kKept - 1]) ? angle(nearest[kKept - 1]) : 4.0f;
  float sum = 0;
  for (int i = 0; i < count; ++i) {
    const float theta = std::max(angle(nearest[i]), 1e-5f);
    out.node[i] = id[i];
    sum += out.weight[i] = std::max(0.0f, 1 - theta / farthest) / theta;
  }
  if (sum > 0)
    for (float& w : out.weight) w /= sum;
  else
    out.weight[0] = 1;
  return out;
}

void blend_nodes(const NodeWeights& w, std::span<const float> values, std::span<float> out) {
  std::fill(out.begin(), out.end(), 0.0f);
  for (int i = 0; i < kNodesBlended; ++i) {
    if (w.weight[i] == 0) continue;
    const float* at = &values[w.node[i] * out.size()];
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += w.weight[i] * at[k];
  }
}

std::vector<std::uint32_t> choose_nodes(std::span<const Eigen::Vector3f> places, const Eigen::Vector3f& center,
                                        std::size_t most) {
  const auto dirs = directions(places, center);
  std::vector<std::uint32_t> chosen;
  std::vector<float> gap(places.size(), std::numeric_limits<float>::infinity());
  for (std::size_t next = 0; chosen.size() < most;) {
    chosen.push_back(std::uint32_t(next));
    for (std::size_t i = 0; i < places.size(); ++i) gap[i] = std::min(gap[i], angle_between(dirs[i], dirs[next]));
    next = std::size_t(std::max_element(gap.begin(), gap.end()) - gap.begin());
    if (gap[next] < kSamePlace) break;
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

Eigen::MatrixXf node_laplacian(std::span<const Eigen::Vector3f> nodes, const Eigen::Vector3f& center) {
  const auto dirs = directions(nodes, center);
  const auto n = std::ptrdiff_t(nodes.size());
  Eigen::MatrixXf w = Eigen::MatrixXf::Zero(n, n);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    std::vector<std::pair<float, std::ptrdiff_t>> near;
    for (std::ptrdiff_t j = 0; j < n; ++j)
      if (j != i) near.push_back({angle_between(dirs[std::size_t(i)], dirs[std::size_t(j)]), j});
    std::sort(near.begin(), near.end());
    for (std::size_t k = 0; k < std::min<std::size_t>(kNeighbours, near.size()); ++k) {
      const float theta = std::max(near[k].first, kSamePlace);
      w(i, near[k].second) = w(near[k].second, i) = 1 / (theta * theta);
    }
  }
  Eigen::MatrixXf laplacian = -w;
  laplacian.diagonal() = w.rowwise().sum();
  const float mean = n > 0 ? laplacian.diagonal().mean() : 0;
  if (mean > 0) laplacian /= mean;
  return laplacian;
}

NodeRegression::NodeRegression(const Eigen::MatrixXf& laplacian, double smoothness, std::size_t terms)
    : laplacian_(laplacian),
      smoothness_(float(smoothness)),
      normal_(laplacian.rows(), laplacian.rows()),
      right_(laplacian.rows(), std::ptrdiff_t(terms)),
      cholesky_(laplacian.rows()) {
  clear();
}

void NodeRegression::clear() {
  sum_ = 0, count_ = 0;
  normal_.setZero(), right_.setZero();
}

void NodeRegression::add(const NodeWeights& w, float trust, std::span<const float> values) {
  sum_ += trust, ++count_;
  const Eigen::Map<const Eigen::RowVectorXf> value(values.data(), right_.cols());
  for (int i = 0; i < kNodesBlended; ++i) {
    for (int j = 0; j < kNodesBlended; ++j) normal_(w.node[i], w.node[j]) += trust * w.weight[i] * w.weight[j];
    right_.row(w.node[i]) += trust * w.weight[i] * value;
  }
}

void NodeRegression::solve(std::span<float> out) {
  Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> values(out.data(), right_.rows(),
                                                                                           right_.cols());
  if (count_ == 0) {
    values.setZero();
    return;
  }
  const float ordinary = sum_ / float(count_);
  normal_ += smoothness_ * ordinary * laplacian_;
  normal_.diagonal().array() += kTowardsMean * ordinary;
  cholesky_.compute(normal_);
  values = cholesky_.solve(right_);
}

}  // namespace lumihull::slf
