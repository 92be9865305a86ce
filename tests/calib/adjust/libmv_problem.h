#pragma once

// Bundle adjustment problems of libmv's collection, in their own camera model, for the same solver.

#include <lumihull/base/pose.h>

#include <filesystem>

#include "adjust/least_squares.h"

namespace lumihull::test {

/// x = R X + t, n = (x/z, y/z); distorted = n (1 + k1 r² + k2 r⁴ + k3 r⁶) + tangential part; pixel = f distorted + c:
/// the reverse of Lumihull's direction.
class LibmvProblem final : public calib::bundle::LeastSquares {
 public:
  struct Marker {
    std::int32_t camera = 0, point = 0;  ///< indices
    Eigen::Vector2d pixel{0, 0};
  };
  /// f, u0, v0, k1, k2, k3, p1, p2
  using Lens = Eigen::Matrix<double, 8, 1>;

  /// A file: byte order 'v' (little) or 'V'; 'P' (pixels) or 'N'; 8 floats of the lens; cameras (image, R by columns,
  /// t), points (track, X), markers (image, track, x, y), all of int32 and float32. Throws std::runtime_error. Markers
  /// without camera or point, and points with fewer than two, are left out. free_lens: f, k1, k2 are unknowns.
  LibmvProblem(const std::filesystem::path& file, bool free_lens);

  double evaluate(std::size_t term, double* residual, double* jacobian) const override;
  bool move(const Eigen::VectorXd& step) override;
  void keep() override { kept_ = moved_; }
  Eigen::MatrixXd gauge() const override;

  double rms_px() const;  ///< sqrt(Σ (dx² + dy²) / markers), at the state moved to
  std::size_t cameras() const { return kept_.cameras.size(); }
  std::size_t points() const { return kept_.points.size(); }
  const std::vector<Marker>& markers() const { return markers_; }

 private:
  struct State {
    Lens lens;
    std::vector<Pose> cameras;
    std::vector<Eigen::Vector3d> points;
  };
  State kept_, moved_;
  std::vector<Marker> markers_;
  bool pixels_ = true, free_lens_ = false;
};

}  // namespace lumihull::test
