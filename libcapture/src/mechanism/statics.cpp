// Inverse kinematics and static equilibrium.
#include <lumihull/base/error.h>
#include <lumihull/capture/statics.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry.h"
#include "nnls.h"

namespace lumihull::capture {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kRank = 1e-8;        ///< least singular value that counts
constexpr double kZero = 1e-9;        ///< of the weight: a tension that may be rounding
constexpr double kFar = 1e5;          ///< of the weight: tensions beyond it are not looked for
constexpr double kUnbalanced = 1e-9;  ///< of the weight: residual of a wrench that no tensions balance

double weight_N(const Mechanism& mechanism) { return mechanism.mass_kg * mechanism.gravity_m_s2; }

/// -r of eq. 3, torques divided by the characteristic length.
Vector6 scaled_load(const Mechanism& mechanism, const Pose& pose, double length) {
  const Eigen::Vector3d force(0, 0, weight_N(mechanism));
  Vector6 load;
  load << force, (pose.rotation * mechanism.center_of_mass).cross(force) / length;
  return load;
}

Balance judge(const Mechanism& mechanism, const double* tension) {
  const double zero = kZero * weight_N(mechanism);
  bool within = true;
  for (std::size_t i = 0; i < mechanism.cables.size(); ++i) {
    const Cable& cable = mechanism.cables[i];
    if (!(tension[i] >= -zero)) return Balance::unbalanced;
    within = within && tension[i] >= cable.min_tension_N - zero && tension[i] <= cable.max_tension_N + zero;
  }
  return within ? Balance::controlled : Balance::loose;
}

/// W t = -r for six cables, and a lower bound of W's smallest singular value.
struct SixCables {
  std::array<double, 6> tension_N{};
  double bound = 0;
};

/// Gaussian elimination with row pivots; rows are padded to whole vector registers.
///
/// Bound: the singular values' product is |det W|, and by the inequality of the means the five largest have a product
/// of at most (|W|_F² / 5)^(5/2), so sigma_6 >= |det W| (5 / |W|_F²)^(5/2) (Yu & Gu 1997).
SixCables solve_six(const Mechanism& mechanism, const Pose& pose, double length) {
  alignas(32) double m[6][8];
  const Eigen::Matrix3d q = pose.rotation.toRotationMatrix();
  const double inverse_length = 1 / length;
  double frobenius = 6;
  for (int i = 0; i < 6; ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    const Eigen::Vector3d c = q * cable.attachment;
    const Eigen::Vector3d d = cable.departure - pose.translation - c;
    const double l2 = d.squaredNorm();
    if (!(l2 > internal::kShortest_m * internal::kShortest_m)) internal::fail_without_direction(cable);
    const Eigen::Vector3d u = d * (1 / std::sqrt(l2));
    const Eigen::Vector3d torque = c.cross(u) * inverse_length;
    for (int k = 0; k < 3; ++k) m[k][i] = u[k], m[3 + k][i] = torque[k];
    frobenius += torque.squaredNorm();
  }
  const Vector6 load = scaled_load(mechanism, pose, length);
  for (int k = 0; k < 6; ++k) m[k][6] = load[k], m[k][7] = 0;

  double* row[6] = {m[0], m[1], m[2], m[3], m[4], m[5]};
  double determinant = 1;
  for (int k = 0; k < 6; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 6; ++i)
      if (std::abs(row[i][k]) > std::abs(row[pivot][k])) pivot = i;
    std::swap(row[k], row[pivot]);
    const double diagonal = row[k][k];
    determinant *= diagonal;
    if (diagonal == 0) return {};
    const double inverse = 1 / diagonal;
    for (int i = k + 1; i < 6; ++i) {
      const double factor = row[i][k] * inverse;
      for (int j = 0; j < 8; ++j) row[i][j] -= factor * row[k][j];
    }
  }
  SixCables result;
  for (int k = 5; k >= 0; --k) {
    double sum = row[k][6];
    for (int j = k + 1; j < 6; ++j) sum -= row[k][j] * result.tension_N[std::size_t(j)];
    result.tension_N[std::size_t(k)] = sum / row[k][k];
  }
  const double mean = 5 / frobenius;
  result.bound = std::abs(determinant) * mean * mean * std::sqrt(mean);
  return result;
}

double smallest_singular_value(const Matrix6& w) {
  const Matrix6 square = w * w.transpose();
  const double least = Eigen::SelfAdjointEigenSolver<Matrix6>(square, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (least > 1e-8) return std::sqrt(least);  // to eight digits; below, squaring costs too many
  return Eigen::JacobiSVD<Matrix6>(w).singularValues()[5];
}

using NullSpace = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;

/// t of least norm among t0 + N z within the limits; t0 is orthogonal to N's columns. False if there is none.
bool nearest_within(const CableVector& t0, const NullSpace& n, const CableVector& lower, const CableVector& upper,
                    double weight, CableVector* t) {
  const Eigen::Index cables = t0.size();
  const double slack = kZero * weight;
  CableVector found = t0;
  if (n.cols() == 0) {
    if ((t0 - lower).minCoeff() < -slack || (upper - t0).minCoeff() < -slack) return false;
  } else {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, internal::kMaxUnknowns, 12> g(2 * cables, n.cols());
    internal::SmallVector h(2 * cables);
    Eigen::Index rows = 0;
    for (Eigen::Index i = 0; i < cables; ++i) {
      g.row(rows) = n.row(i), h[rows++] = (lower[i] - slack - t0[i]) / weight;
      if (std::isfinite(upper[i])) g.row(rows) = -n.row(i), h[rows++] = (t0[i] - upper[i] - slack) / weight;
    }
    g.conservativeResize(rows, Eigen::NoChange);
    h.conservativeResize(rows);
    CableVector z;
    if (!internal::least_distance(g, h, kFar, &z)) return false;
    found += weight * (n * z);
    // Near the verge of the feasible set the least distance is found before its rounding is small: look again.
    if ((found - lower).minCoeff() < -1e3 * slack || (upper - found).minCoeff() < -1e3 * slack) return false;
  }
  *t = found;
  return true;
}

/// Any number of cables, any rank.
Tensions general_tensions(const Mechanism& mechanism, const WrenchMatrix& w, const Vector6& load) {
  const Eigen::Index n = w.cols();
  const double weight = weight_N(mechanism);
  Tensions result;
  const Eigen::JacobiSVD<WrenchMatrix> svd(w, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto& s = svd.singularValues();
  Eigen::Index rank = 0;
  while (rank < s.size() && s[rank] > kRank) ++rank;
  result.smallest_singular = n < 6 ? 0 : s[5];

  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> seen = svd.matrixU().leftCols(rank).transpose() * load;
  const Vector6 unseen = load - svd.matrixU().leftCols(rank) * seen;
  bool balanced = false;
  if (unseen.norm() <= kUnbalanced * weight) {
    const CableVector t0 = svd.matrixV().leftCols(rank) * seen.cwiseQuotient(s.head(rank));
    const NullSpace null_space = svd.matrixV().rightCols(n - rank);
    CableVector lower(n), upper(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      lower[i] = mechanism.cables[std::size_t(i)].min_tension_N;
      upper[i] = mechanism.cables[std::size_t(i)].max_tension_N;
    }
    balanced = true;
    if (nearest_within(t0, null_space, lower, upper, weight, &result.tension_N)) {
      result.balance = Balance::controlled;
    } else {
      lower.setZero();
      upper.setConstant(std::numeric_limits<double>::infinity());
      balanced = nearest_within(t0, null_space, lower, upper, weight, &result.tension_N);
      result.balance = balanced ? Balance::loose : Balance::unbalanced;
    }
    if (balanced && rank < 6) result.balance = Balance::singular;
  }
  if (!balanced) {
    internal::SmallRows rest;
    result.tension_N = internal::non_negative_least_squares(w, load, &rest);
  }
  return result;
}

}  // namespace

CableVector cable_lengths(const Mechanism& mechanism, const Pose& world_from_platform) {
  internal::need_usable(mechanism, world_from_platform);
  const Eigen::Matrix3d q = world_from_platform.rotation.toRotationMatrix();
  CableVector lengths(Eigen::Index(mechanism.cables.size()));
  for (Eigen::Index i = 0; i < lengths.size(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    lengths[i] = (cable.departure - world_from_platform.translation - q * cable.attachment).norm();
  }
  return lengths;
}

double characteristic_length(const Mechanism& mechanism) {
  double sum = 0;
  for (const Cable& cable : mechanism.cables) sum += cable.attachment.squaredNorm();
  if (sum > 0) return std::sqrt(sum / double(mechanism.cables.size()));
  return mechanism.platform_radius_m > 0 ? mechanism.platform_radius_m : 1;
}

WrenchMatrix wrench_matrix(const Mechanism& mechanism, const Pose& world_from_platform) {
  internal::need_usable(mechanism, world_from_platform);
  const Eigen::Matrix3d q = world_from_platform.rotation.toRotationMatrix();
  WrenchMatrix w(6, Eigen::Index(mechanism.cables.size()));
  for (Eigen::Index i = 0; i < w.cols(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    const Eigen::Vector3d c = q * cable.attachment;
    const Eigen::Vector3d d = cable.departure - world_from_platform.translation - c;
    const double length = d.norm();
    if (!(length > internal::kShortest_m)) internal::fail_without_direction(cable);
    w.col(i) << d / length, c.cross(d / length);
  }
  return w;
}

Balance static_test(const Mechanism& mechanism, const Pose& world_from_platform) {
  internal::need_usable(mechanism, world_from_platform);
  if (mechanism.cables.size() == 6) {
    const SixCables six = solve_six(mechanism, world_from_platform, characteristic_length(mechanism));
    if (six.bound > kRank) return judge(mechanism, six.tension_N.data());
  }
  return tensions(mechanism, world_from_platform).balance;
}

Tensions tensions(const Mechanism& mechanism, const Pose& world_from_platform) {
  const double length = characteristic_length(mechanism);
  WrenchMatrix w = wrench_matrix(mechanism, world_from_platform);
  w.bottomRows<3>() /= length;
  const Vector6 load = scaled_load(mechanism, world_from_platform, length);
  Tensions result;
  SixCables six;
  if (w.cols() == 6) six = solve_six(mechanism, world_from_platform, length);
  if (six.bound > kRank) {
    result.smallest_singular = smallest_singular_value(w);
    result.balance = judge(mechanism, six.tension_N.data());
    if (result.balance == Balance::unbalanced) {
      internal::SmallRows rest;
      result.tension_N = internal::non_negative_least_squares(w, load, &rest);
    } else {
      result.tension_N = Vector6::Map(six.tension_N.data());
    }
  } else {
    result = general_tensions(mechanism, w, load);
  }
  result.tension_N = result.tension_N.cwiseMax(0);
  result.residual_N = (w * result.tension_N - load).norm();
  return result;
}

}  // namespace lumihull::capture
