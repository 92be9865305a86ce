#pragma once

#include <lumihull/hull/mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lumihull::slf {

/// The normal equations of all vertices' view maps at one photograph: a symmetric sparse system of blocks, one for each
/// vertex and each edge.
class ViewSystem {
 public:
  struct Edges {
    explicit Edges(const hull::Mesh& mesh);
    std::vector<std::array<std::uint32_t, 2>> vertices;     // lower first
    std::vector<std::array<std::uint32_t, 3>> of_triangle;  // of corners (0, 1), (1, 2), (2, 0)
  };

  /// `edges` must outlive the object.
  ViewSystem(std::size_t terms, std::size_t vertices, std::span<const std::array<std::uint32_t, 2>> edges);

  /// Adds a sample: shares Λ of a triangle's corners, lower triangle of w g gᵀ, and w g·residual.
  void add(const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& edges,
           const std::array<float, 3>& share, std::span<const float> gram, std::span<const float> right);

  /// What is behind each vertex: the trace of its block, over the number of terms.
  std::vector<float> trust() const;

  /// Solves with a pull of `ridge` times the mean trust towards the values in `values` (vertices x terms), by conjugate
  /// gradients with the blocks' inverses as preconditioner. Vertices that no sample touches keep their values.
  void solve(std::span<float> values, float ridge) const;

 private:
  void multiply(std::span<const float> x, float ridge, std::span<float> y) const;

  std::size_t terms_, packed_;
  std::span<const std::array<std::uint32_t, 2>> edges_;
  std::vector<float> diagonal_, off_;  // lower triangles (all blocks are symmetric: w Λ Λ' g gᵀ)
  std::vector<float> right_;
};

}  // namespace lumihull::slf
