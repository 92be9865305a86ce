#include "body_shape.h"

#include <lumihull/internal/small_matrices.h>

#include <Eigen/LU>
#include <algorithm>

namespace lumihull::calib::bundle {

Eigen::Vector3d middle(const AdjustedBody& body) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const BodyPoint& point : body.points) sum += point.place;
  return sum / double(std::max<std::size_t>(1, body.points.size()));
}

ShapedPoint shaped(const BodyPoint& point, BodyModel model, const Eigen::Vector3d& middle, const Eigen::Vector3d& bend,
                   const Eigen::Vector2d& print_scale, Matrix35d* place_by, Matrix35d* turn_by) {
  const double sx = print_scale.x(), sy = print_scale.y();
  ShapedPoint shape;
  shape.place = {sx * point.place.x(), sy * point.place.y(), point.place.z()};
  shape.normal = point.normal.normalized();
  if (place_by) {
    place_by->setZero();
    (*place_by)(0, 3) = point.place.x(), (*place_by)(1, 4) = point.place.y();
  }
  if (turn_by) turn_by->setZero();
  if (model != BodyModel::bending) return shape;

  const double a = bend.x(), b = bend.y(), c = bend.z();
  const double px = point.place.x() - middle.x(), py = point.place.y() - middle.y(), x = sx * px, y = sy * py;
  const double slope_x = 2 * a * x + b * y, slope_y = b * x + 2 * c * y;
  shape.place.z() += a * x * x + b * x * y + c * y * y;
  // The surface z = h(x, y) is sheared: a normal n becomes n - n_z grad h.
  const Eigen::Vector3d sheared = shape.normal - shape.normal.z() * Eigen::Vector3d(slope_x, slope_y, 0);
  const double n_z = shape.normal.z();
  shape.normal = sheared.normalized();
  if (place_by) {
    place_by->row(2) << x * x, x * y, y * y, slope_x * px, slope_y * py;
  }
  if (turn_by) {
    Eigen::Matrix<double, 2, 5> slopes;
    slopes << 2 * x, y, 0, 2 * a * px, b * py, 0, x, 2 * y, b * px, 2 * c * py;
    // A change dn turns n by n x dn / |n|².
    for (int i = 0; i < 5; ++i)
      turn_by->col(i) = sheared.cross(-n_z * Eigen::Vector3d(slopes(0, i), slopes(1, i), 0)) / sheared.squaredNorm();
  }
  return shape;
}

BestTurn best_turn(const Eigen::Matrix3d& product) {
  const internal::NearestRotation nearest = internal::nearest_rotation(product);
  const Eigen::Vector3d& s = nearest.singular_values;
  return {nearest.rotation, s[0] + s[1] + (nearest.reflected ? -s[2] : s[2]), s[1] > 1e-9 * s[0]};
}

}  // namespace lumihull::calib::bundle
