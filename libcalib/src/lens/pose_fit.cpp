#include "lens/pose_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lumihull::calib {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

template <bool kCircles>
NormalEquations sum(const ResectionPoints& points, const LocalPose& pose, std::span<const double> weights,
                    double cauchy) {
  // Upper triangle by rows, then the gradient: 27 sums, each in four lanes.
  Lanes h[21], g[6], cost = Lanes::Zero();
  for (Lanes& x : h) x.setZero();
  for (Lanes& x : g) x.setZero();
  bool front = true;
  for (std::size_t at = 0; at < points.blocks.size(); ++at) {
    const ResectionPoints::Block& b = points.blocks[at];
    Lanes weight = Eigen::Map<const Lanes>(&weights[at * kLanes]);
    const BlockResidual o = BlockResidual::at<kCircles>(b, pose);
    const Lanes d2 = o.rx * o.rx + o.ry * o.ry;
    if (cauchy > 0) {
      const double c2 = cauchy * cauchy;
      // A point that is not in front costs as much as one that is very far off.
      const Lanes safe = (o.front > 0).select(d2, 1e12 * c2);
      cost += c2 * weight * (1 + safe / c2).log();
      weight = (o.front > 0).select(weight / (1 + d2 / c2), 0);
    } else {
      front = front && (o.front > 0 || weight == 0).all();
      weight = (o.front > 0).select(weight, 0);
      cost += (weight > 0).select(weight * d2, 0);
    }
    // Rows of d r / d (predicted point).
    Lanes j[2][6];
    for (int row = 0; row < 2; ++row) {
      const Lanes ax = (row ? b.w10 : b.w00) * o.iz, ay = (row ? b.w11 : b.w01) * o.iz;
      const Lanes az = -(ax * o.cx + ay * o.cy);
      Lanes tz = az, gx, gy, gz;
      if constexpr (kCircles) {
        // point = q + k (n_z n - e₃), k = r² / q_z: by q, and by the normal
        const Lanes an = ax * o.nx + ay * o.ny + az * o.nz;
        tz += o.k / (o.pz + pose.center.z()) * (az - o.nz * an);
        gx = o.k * o.nz * ax, gy = o.k * o.nz * ay, gz = o.k * (o.nz * az + an);
      }
      j[row][0] = o.py * tz - o.pz * ay;
      j[row][1] = o.pz * ax - o.px * tz;
      j[row][2] = o.px * ay - o.py * ax;
      if constexpr (kCircles) {
        j[row][0] += o.ny * gz - o.nz * gy;
        j[row][1] += o.nz * gx - o.nx * gz;
        j[row][2] += o.nx * gy - o.ny * gx;
      }
      j[row][3] = ax, j[row][4] = ay, j[row][5] = tz;
    }
    if ((weight == 0).any())  // 0 * infinity
      for (auto& row : j)
        for (Lanes& x : row) x = (weight > 0).select(x, 0);
    const Lanes rx = (weight > 0).select(o.rx, 0), ry = (weight > 0).select(o.ry, 0);
    for (int i = 0, at_h = 0; i < 6; ++i) {
      const Lanes p = weight * j[0][i], q = weight * j[1][i];
      for (int k = i; k < 6; ++k, ++at_h) h[at_h] += p * j[0][k] + q * j[1][k];
      g[i] += p * rx + q * ry;
    }
  }
  NormalEquations sums;
  for (int i = 0, at_h = 0; i < 6; ++i) {
    for (int k = i; k < 6; ++k, ++at_h) sums.information(i, k) = sums.information(k, i) = h[at_h].sum();
    sums.gradient[i] = g[i].sum();
  }
  sums.cost = front ? cost.sum() : std::numeric_limits<double>::infinity();
  return sums;
}

/// One run with lens terms as they are.
void run(const ResectionPoints& points, std::span<const double> weights, double cauchy, int max_iterations,
         PoseFit& fit) {
  fit.at = normal_equations(points, fit.pose, weights, cauchy);
  double damping = 0;
  for (int i = 0; i < max_iterations; ++i) {
    // Diagonal scaled to 1, so that a pivot tells how well a parameter is determined beside the others.
    const Vector6d scale = fit.at.information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Matrix6d scaled = scale.asDiagonal() * fit.at.information * scale.asDiagonal();
    scaled.diagonal().array() += damping + 1e-15;
    const Eigen::LDLT<Matrix6d> solver(scaled);
    fit.regular = solver.vectorD().minCoeff() > 1e-13 && fit.at.information.allFinite();
    if (!fit.at.information.allFinite()) return;
    const Vector6d step = -(scale.asDiagonal() * solver.solve(scale.cwiseProduct(fit.at.gradient)));
    if (!step.allFinite()) return;
    const double promised = -step.dot(fit.at.gradient);
    if (promised <= 1e-12 * fit.at.cost || fit.at.cost == 0) return;
    if (step.norm() < 1e-14 * (1 + fit.pose.center.norm())) return;  // rounding
    const LocalPose next = moved(fit.pose, step);
    const NormalEquations there = normal_equations(points, next, weights, cauchy);
    ++fit.iterations;
    if (there.cost < fit.at.cost) {
      fit.pose = next, fit.at = there;
      damping = damping < 1e-6 ? 0 : 0.1 * damping;
    } else {
      if (damping > 1e8) return;
      damping = std::max(1e-3, 10 * damping);
    }
  }
}

}  // namespace

NormalEquations normal_equations(const ResectionPoints& points, const LocalPose& pose, std::span<const double> weights,
                                 double cauchy) {
  return points.circles ? sum<true>(points, pose, weights, cauchy) : sum<false>(points, pose, weights, cauchy);
}

LocalPose moved(const LocalPose& pose, const Vector6d& step) {
  const double angle = step.head<3>().norm();
  LocalPose next = pose;
  if (angle > 0) next.rotation = Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix() * pose.rotation;
  next.center += step.tail<3>();
  return next;
}

void minimise(ResectionPoints& points, std::span<const double> weights, double cauchy, int max_iterations, bool lens,
              PoseFit& fit) {
  run(points, weights, cauchy, max_iterations, fit);
  if (points.lens.empty() || !lens) return;
  constexpr int kRounds = 8;
  const double freedom = std::max(1.0, 2 * double(std::count(weights.begin(), weights.end(), 1.0)) - 6);
  for (int round = 0; round < kRounds; ++round) {
    const LocalPose before = fit.pose;
    points.renew_lens_terms(fit.pose);
    run(points, weights, cauchy, max_iterations, fit);
    // How far the pose went, in standard deviations. The terms change by a hundredth or less of what the pose does, so
    // that a thirtieth of one leaves nothing to be seen.
    Vector6d motion;
    const Eigen::AngleAxisd turn(Matrix3d(fit.pose.rotation * before.rotation.transpose()));
    motion << turn.angle() * turn.axis(), fit.pose.center - before.center;
    if (motion.dot(fit.at.information * motion) <= 1e-3 * fit.at.cost / freedom) break;
  }
}

}  // namespace lumihull::calib
