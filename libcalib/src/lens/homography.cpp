// Homography from point pairs: Hartley & Zisserman 2000, ch. 4 (normalised DLT, then the transfer error is minimised).
#include <lumihull/base/error.h>
#include <lumihull/calib/resect.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace lumihull::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using Vector8 = Eigen::Matrix<double, 8, 1>;

[[noreturn]] void degenerate(const char* message) { throw Error(ErrorCode::degenerate, message, "find_homography"); }

/// normalised = scale (point - mean): mean 0, mean square 2.
struct Normalisation {
  Vector2d mean{0, 0};
  double scale = 1;

  explicit Normalisation(std::span<const Vector2d> points) {
    for (const Vector2d& p : points) mean += p;
    mean /= double(points.size());
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    for (const Vector2d& p : points) moments += (p - mean) * (p - mean).transpose();
    if (!moments.allFinite()) throw Error(ErrorCode::invalid_argument, "points must be finite", "find_homography");
    const Vector2d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(moments).eigenvalues();
    if (!(axes[0] > 1e-14 * axes[1])) degenerate("points lie on one line, or are one point");
    scale = std::sqrt(2 * double(points.size()) / moments.trace());
  }
  Vector2d operator()(const Vector2d& p) const { return scale * (p - mean); }
  Matrix3d matrix() const {
    Matrix3d m;
    m << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
    return m;
  }
  Matrix3d inverse() const {
    Matrix3d m;
    m << 1 / scale, 0, mean.x(), 0, 1 / scale, mean.y(), 0, 0, 1;
    return m;
  }
};

/// The two rows of a pair: of the transfer error's derivative by h00 … h21 at denominator w, predicted image q.
void rows_of(const Vector2d& p, const Vector2d& q, double w, Vector8& x, Vector8& y) {
  const Vector3d h = Vector3d(p.x(), p.y(), 1) / w;
  x << h, 0, 0, 0, -h.x() * q.x(), -h.y() * q.x();
  y << 0, 0, 0, h, -h.x() * q.y(), -h.y() * q.y();
}

}  // namespace

Matrix3d find_homography(std::span<const Vector2d> a, std::span<const Vector2d> b) {
  if (a.size() != b.size() || a.size() < 4)
    throw Error(ErrorCode::invalid_argument, "expected at least 4 pairs of points", "find_homography");
  const Normalisation na(a), nb(b);

  // Around the points' centre the denominator can't vanish (all points are seen on one side of the plane's horizon), so
  // that h22 = 1 is a safe scale. The linear answer, then Gauss-Newton steps, damped where they don't help.
  Matrix3d h = Matrix3d::Identity();
  double error = 0;
  double damping = 0;
  bool linear = true;
  for (int iteration = 0; iteration < 30; ++iteration) {
    Matrix8 normal = Matrix8::Zero();
    Vector8 right = Vector8::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Vector2d p = na(a[i]), target = nb(b[i]);
      const Vector3d image = h * Vector3d(p.x(), p.y(), 1);
      Vector8 x, y;
      if (linear) {  // w (target - …) = 0 with w = 1: linear in h
        rows_of(p, target, 1, x, y);
        right += target.x() * x + target.y() * y;
      } else {
        const Vector2d q = image.head<2>() / image.z();
        rows_of(p, q, image.z(), x, y);
        const Vector2d residual = target - q;
        right += residual.x() * x + residual.y() * y;
      }
      normal.selfadjointView<Eigen::Lower>().rankUpdate(x);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(y);
    }
    if (damping > 0) normal.diagonal() *= 1 + damping;
    const Eigen::LDLT<Matrix8> solver(normal);
    const Vector8 d = solver.vectorD();
    if (linear && !(d.minCoeff() > 1e-13 * d.maxCoeff()))
      degenerate("points don't determine a homography: three of four, or all but one, lie on a line");
    const Vector8 step = solver.solve(right);
    Matrix3d next = linear ? Matrix3d::Zero().eval() : h;
    if (linear) next(2, 2) = 1;
    for (int i = 0; i < 8; ++i) next(i / 3, i % 3) += step[i];
    double next_error = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Vector2d p = na(a[i]);
      const Vector3d image = next * Vector3d(p.x(), p.y(), 1);
      next_error = image.z() > 0 ? next_error + (image.head<2>() / image.z() - nb(b[i])).squaredNorm()
                                 : std::numeric_limits<double>::infinity();
    }
    if (linear) {
      if (!std::isfinite(next_error)) degenerate("points lie on both sides of the plane's horizon");
      h = next, error = next_error, linear = false;
      continue;
    }
    const double size = step.cwiseAbs().maxCoeff();
    if (next_error <= error) {
      h = next, damping *= 0.1;
      const bool done = size < 1e-9 || error - next_error < 1e-12 * error;
      error = next_error;
      if (done) break;
    } else {
      if (size < 1e-9) break;
      damping = std::max(1e-3, 10 * damping);
    }
  }
  Matrix3d result = nb.inverse() * h * na.matrix();
  if (!(std::abs(h.determinant()) > 1e-12 * h.norm())) degenerate("points of the second picture lie on one line");
  return result / result.norm();
}

}  // namespace lumihull::calib
