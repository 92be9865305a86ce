#pragma once

#include <Eigen/Core>
#include <vector>

namespace lumihull::calib {

/// What a pixel sees of a straight edge between two half-planes: step * Gaussian blur * the pixel's square.
///
/// F(x) is the share of the light half-plane in a pixel whose centre lies x px on the light side of the edge. A unit
/// square projected onto the edge's normal n is the convolution of two boxes, |n_x| and |n_y| wide, so that with the
/// iterated integrals of the normal distribution
///
///     A0 = Φ(x/σ),  A1 = x Φ + σ φ,  A2 = ((x² + σ²) Φ + x σ φ) / 2
///     F(x) = (A2(x + p) − A2(x + m) − A2(x − m) + A2(x − p)) / (|n_x| |n_y|),  p, m = (|n_x| ± |n_y|) / 2
///
/// and dF/dx the same of A1, dF/dσ = σ d²F/dx² (the heat equation), the same of A0.
///
/// Tabulated once for a blur and a direction, then interpolated (Hermite; F to 1e-5): an edge has many pixels.
class EdgeProfile {
 public:
  struct Value {
    double share, by_x, by_sigma;
  };

  /// normal: of unit length; sigma >= 0.05 px.
  EdgeProfile(const Eigen::Vector2d& normal, double sigma);

  Value at(double x) const;
  double sigma() const { return sigma_; }

 private:
  struct Node {
    double f0, f1, f2;  ///< F and its derivatives
  };
  double sigma_, reach_, step_;
  std::vector<Node> nodes_;
};

}  // namespace lumihull::calib
