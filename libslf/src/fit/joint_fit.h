#pragma once

#include <lumihull/base/job.h>
#include <lumihull/hull/mesh.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "atlas/atlas.h"
#include "atlas/surface_samples.h"
#include "texel_fit.h"
#include "view_nodes.h"

namespace lumihull::slf {

inline constexpr int kMaxStartTerms = 12;

struct JointFitOptions {
  int terms = 6;
  int iterations = 8;
  double surface_ridge = 0.05;
  double view_smoothness = 0.02;
  bool mean_alone = false;  // whether, without terms, the mean colour is all that will be shown
};

/// Factors as numbers. Texels and terms: `mean` (texels x 3), `surface` (texels x terms x 3); `seen`: sum of a texel's
/// weights. View maps: `view` (vertices x nodes x terms), of unit mean square.
struct JointFactors {
  std::vector<float> mean, surface, seen;
  std::vector<float> view;
};

/// min Σ w |c - T - Σ_k g_k Σ_j Λ_j h_k[v_j](e)|² over the samples of the photographs at the nodes by turns: surface
/// maps and mean colour of each texel exactly; then the view maps of all vertices together for each photograph; then
/// the values at the nodes that agree best with these. In the end surface maps and mean colour once more, over all
/// photographs' samples. See README, "Joint factorisation".
class JointFit {
 public:
  /// nodes: places; at_node: the photographs there, ascending. What is given must outlive the object.
  JointFit(const hull::Mesh& mesh, const Atlas& atlas, std::span<const PhotoSamples> photos,
           std::span<const Eigen::Vector3f> nodes, std::span<const std::uint32_t> at_node,
           const JointFitOptions& options);

  JointFactors run(Job& job);

  /// Of the variance about each texel's mean colour, at photographs that had no part in the fit, the share that the
  /// terms explain. For comparisons: fewer turns than run makes.
  double held(Job& job);

  /// How many terms, the first ones, hold at photographs that had no part in them; the others are zero.
  std::size_t kept() const {
    return std::size_t(std::count_if(share_.begin(), share_.end(), [](float s) { return s > 0; }));
  }

  /// Root mean squares of the samples' weighted residuals: with the factors, and with the mean colour alone.
  double rms = 0, rms_of_mean = 0;

 private:
  static constexpr std::size_t kFolds = 4;  // of those at nodes every fourth is left out together
  static constexpr std::size_t kNoFold = kFolds;
  static constexpr std::size_t kBlocksAtOnce = 32, kVerticesAtOnce = 64;

  void start();
  void evaluate_nodes(Job& job);
  void add_samples(TexelFit& fit, std::size_t block, std::size_t photo) const;
  float frontal(const Texel& texel, std::size_t photo) const;
  void fit_surface(std::span<const std::uint32_t> photos, Job& job);
  void fit_views(Job& job);
  void fit_nodes(Job& job);
  void regress(std::size_t vertex, NodeRegression& regression, std::size_t left_out, std::span<float> out) const;
  void normalise();
  void fit_view(std::size_t photo);
  void alternate(int iterations, Job& job);
  void cross_validate(Job& job);

  /// Values of all terms at a texel from those at the vertices of the mesh (vertices x terms).
  void interpolate(const std::vector<float>& views, const Texel& texel, float* out) const;

  float* view_at(std::size_t photo, std::size_t vertex) { return &views_[photo][vertex * terms_]; }

  const hull::Mesh& mesh_;
  const Atlas& atlas_;
  std::span<const PhotoSamples> photos_;
  std::span<const Eigen::Vector3f> nodes_;
  std::span<const std::uint32_t> at_node_;
  JointFitOptions options_;
  std::size_t terms_, vertices_, blocks_;
  Eigen::Vector3f middle_;
  Eigen::MatrixXf laplacian_;
  std::vector<std::array<std::uint32_t, 3>> edges_of_;  // of each triangle, see ViewSystem::Edges
  std::vector<std::array<std::uint32_t, 2>> edges_;     // lower vertex first
  std::vector<Eigen::Vector3f> normals_;                // of the vertices, where the mean colour is all that is shown
  std::vector<std::vector<NodeWeights>> weights_;       // photographs x vertices
  std::vector<std::vector<float>> views_;               // photographs x vertices x terms: view maps at the photographs
  std::vector<std::vector<float>> trust_;               // photographs x vertices: the weight behind them
  std::vector<float> share_;                            // of each term, see cross_validate; empty before
  double held_ = 0;                                     // see held
  JointFactors factors_;
};

}  // namespace lumihull::slf
