#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::slf {

inline constexpr int kNodesBlended = 3;

/// How much the values at nodes count for an eye: Σ weight = 1. Unused entries have weight 0.
struct NodeWeights {
  std::array<std::uint8_t, kNodesBlended> node{};
  std::array<float, kNodesBlended> weight{};
};

/// The nodes next to the eye as seen from a point, by their angles θ (Buehler et al. 2001, 4.1: w = (1/θ)(1 - θ/θ_max),
/// θ_max the angle of the nearest node that is left out), so that weights vanish where nodes change, and an eye at a
/// node has that node's values.
NodeWeights node_weights(std::span<const Eigen::Vector3f> nodes, const Eigen::Vector3f& point,
                         const Eigen::Vector3f& eye);

/// Σ weight · value: `values` at the nodes (nodes x terms), `out` of as many values as there are terms.
void blend_nodes(const NodeWeights& weights, std::span<const float> values, std::span<float> out);

/// At most `most` of the given places, spread evenly over the directions from `center`: the first, then always the one
/// farthest from those taken. Places that differ by less than a tenth of a degree count as one. In ascending order.
std::vector<std::uint32_t> choose_nodes(std::span<const Eigen::Vector3f> places, const Eigen::Vector3f& center,
                                        std::size_t most);

/// Graph Laplacian over nodes (symmetric, positive semidefinite, rows sum to 0): each node and its four nearest in
/// direction from `center`, weighted by 1/angle², scaled so that the diagonal's mean is 1.
Eigen::MatrixXf node_laplacian(std::span<const Eigen::Vector3f> nodes, const Eigen::Vector3f& center);

/// The values at the nodes of one vertex that agree best with values at other places, weighted by the trust in these:
/// smooth over neighbouring nodes, and drawn to 0 where nothing is known nearby.
class NodeRegression {
 public:
  /// laplacian: see node_laplacian; must outlive the object. smoothness: in shares of the ordinary trust.
  NodeRegression(const Eigen::MatrixXf& laplacian, double smoothness, std::size_t terms);

  void clear();
  /// `values` of all terms at a place that has these weights.
  void add(const NodeWeights& weights, float trust, std::span<const float> values);
  /// nodes x terms; all 0 where nothing was added.
  void solve(std::span<float> out);

 private:
  const Eigen::MatrixXf& laplacian_;
  float smoothness_;
  float sum_ = 0;
  int count_ = 0;
  Eigen::MatrixXf normal_, right_;
  Eigen::LLT<Eigen::MatrixXf> cholesky_;
};

}  // namespace lumihull::slf
