#pragma once

// Where a body's points are in its own frame: as printed, scaled and bent.

#include <lumihull/calib/adjustment.h>

namespace lumihull::calib::bundle {

using Matrix35d = Eigen::Matrix<double, 3, 5>;

/// Mean of the points as printed: what a body turns about, and bends from.
Eigen::Vector3d middle(const AdjustedBody& body);

/// A point in the body's frame, with (x, y) = print scale · (place - middle): place + bend's a x² + b x y + c y² along
/// z.
struct ShapedPoint {
  Eigen::Vector3d place{0, 0, 0};
  Eigen::Vector3d normal{0, 0, 1};  ///< unit length
};
/// The body's model is rigid or bending. place_by, turn_by: d place, and rotation vector of the normal, by (a, b, c,
/// scale x, scale y); the first three are zero where the body is rigid.
ShapedPoint shaped(const BodyPoint& point, BodyModel model, const Eigen::Vector3d& middle, const Eigen::Vector3d& bend,
                   const Eigen::Vector2d& print_scale, Matrix35d* place_by = nullptr, Matrix35d* turn_by = nullptr);

/// R of least Σ |y - R x|² from Σ y xᵀ about the means (Umeyama 1991, eqs. 40 to 42), and the scale's numerator tr(D
/// S).
struct BestTurn {
  Eigen::Matrix3d rotation;
  double trace = 0;
  bool unique = false;  ///< false: the points lie on a line, and any turn about it is as good
};
BestTurn best_turn(const Eigen::Matrix3d& product);

}  // namespace lumihull::calib::bundle
