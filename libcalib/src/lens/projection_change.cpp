#include "projection_change.h"

#include <lumihull/base/error.h>

#include <Eigen/Dense>

namespace lumihull::calib {
namespace lens {

std::vector<PixelChange> pixel_changes(const Camera& camera, int columns, int rows) {
  std::vector<PixelChange> changes;
  std::vector<Matrix23d> by_rotation;
  Eigen::Matrix3d gg = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, kIntrinsics> gj = Eigen::Matrix<double, 3, kIntrinsics>::Zero();
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      PixelChange& change = changes.emplace_back();
      Matrix23d& g = by_rotation.emplace_back(Matrix23d::Zero());
      change.pixel = {camera.width * (x + 0.5) / columns, camera.height * (y + 0.5) / rows};
      const auto ray = camera.ray(change.pixel);
      if (!ray) continue;
      change.ray = *ray;
      Matrix23d by_point;
      if (!camera.project_with_parameter_jacobian(*ray, nullptr, &by_point, &change.by_camera)) continue;
      change.valid = true;
      g = -by_point * cross_matrix(*ray);
      gg += g.transpose() * g;
      gj += g.transpose() * change.by_camera;
    }
  const Eigen::Matrix<double, 3, kIntrinsics> compensation = gg.ldlt().solve(gj);
  for (std::size_t i = 0; i < changes.size(); ++i)
    if (changes[i].valid) changes[i].by_camera -= by_rotation[i] * compensation;
  return changes;
}

}  // namespace lens

std::vector<double> projection_uncertainty(const LensCalibration& calibration, int columns, int rows) {
  if (columns < 2 || rows < 2 || columns > 10000 || rows > 10000)
    throw Error(ErrorCode::invalid_argument, "projection uncertainty: columns and rows must be 2 … 10000");
  calibration.camera.validate();
  std::vector<double> sigma;
  for (const lens::PixelChange& change : lens::pixel_changes(calibration.camera, columns, rows)) {
    if (!change.valid) {
      sigma.push_back(std::numeric_limits<double>::infinity());
      continue;
    }
    const Eigen::Matrix2d c = change.by_camera * calibration.covariance * change.by_camera.transpose();
    const double mean = 0.5 * c.trace(), half = 0.5 * (c(0, 0) - c(1, 1));
    sigma.push_back(std::sqrt(std::max(0.0, mean + std::hypot(half, c(0, 1)))));
  }
  return sigma;
}

}  // namespace lumihull::calib
