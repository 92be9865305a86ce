#include "energy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "geometry.h"

namespace lumihull::capture::internal {
namespace {

/// d² of v . exp(ω) c over ω: v . (ω x (ω x c)) / 2 = ((ω . c)(ω . v) - (c . v) ω²) / 2.
Eigen::Matrix3d turning(const Eigen::Vector3d& c, const Eigen::Vector3d& v) {
  return 0.5 * (c * v.transpose() + v * c.transpose()) - c.dot(v) * Eigen::Matrix3d::Identity();
}

/// The p that minimises g . p + p B p / 2 with |p| <= radius, B given by its eigenvalues and -vectors.
Vector6 trust_region_step(const Vector6& g, const Eigen::SelfAdjointEigenSolver<Matrix6>& b, double radius) {
  const Vector6 values = b.eigenvalues(), along = b.eigenvectors().transpose() * g;
  const auto step = [&](double shift) { return Vector6(-along.cwiseQuotient((values.array() + shift).matrix())); };
  if (values[0] > 1e-14 * std::max(1.0, values[5])) {
    const Vector6 newton = step(0);
    if (newton.norm() <= radius) return b.eigenvectors() * newton;
  }
  // 1 / |p| is nearly linear in the shift; bisection keeps Newton's method in bounds.
  double low = std::max(0.0, -values[0]), high = low + g.norm() / radius + 1e-12 * values.cwiseAbs().maxCoeff();
  if (std::abs(along[0]) < 1e-12 * g.norm() && values[0] < 0) {  // the hard case: add what has no slope
    Vector6 p = Vector6::Zero();
    for (int i = 1; i < 6; ++i)
      if (values[i] + low > 1e-12 * std::abs(values[5])) p[i] = -along[i] / (values[i] + low);
    if (p.norm() < radius) {
      p[0] = std::sqrt(radius * radius - p.squaredNorm());
      return b.eigenvectors() * p;
    }
  }
  double shift = high;
  for (int i = 0; i < 60; ++i) {
    const Vector6 p = step(shift);
    const double size = p.norm();
    if (std::abs(size - radius) < 1e-3 * radius) break;
    (size > radius ? low : high) = shift;
    const double slope = p.cwiseAbs2().cwiseQuotient((values.array() + shift).matrix()).sum();
    double next = shift + (size - radius) / radius * size * size / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    shift = next;
  }
  Vector6 p = step(shift);
  if (p.norm() > radius) p *= radius / p.norm();
  return b.eigenvectors() * p;
}

}  // namespace

Pose moved(const Pose& pose, const Vector6& twist) {
  const Eigen::Vector3d turn = twist.tail<3>();
  const double angle = turn.norm();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  if (angle > 0) q = Eigen::AngleAxisd(angle, turn / angle);
  return {(q * pose.rotation).normalized(), pose.translation + twist.head<3>()};
}

LengthTerm cable_length_term(const Cable& cable, const Pose& pose, double factor, Matrix6* hessian) {
  const Eigen::Vector3d c = pose.rotation * cable.attachment;
  const Eigen::Vector3d e = pose.translation + c - cable.departure;
  LengthTerm term;
  term.length_m = e.norm();
  if (!(term.length_m > kShortest_m)) fail_without_direction(cable);
  const Eigen::Vector3d v = e / term.length_m;
  term.gradient << v, c.cross(v);
  if (hessian) {
    // Through J = [I, -[c]x]: e turns against its own direction ((I - v vᵀ) / l), and exp bends the attachment's way.
    const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - v * v.transpose()) / term.length_m;
    Eigen::Matrix<double, 3, 6> j;
    j << Eigen::Matrix3d::Identity(),
        (Eigen::Matrix3d() << 0, c.z(), -c.y(), -c.z(), 0, c.x(), c.y(), -c.x(), 0).finished();
    *hessian += factor * (j.transpose() * across * j);
    hessian->bottomRightCorner<3, 3>() += factor * turning(c, v);
  }
  return term;
}

PotentialTerm gravity_term(const Mechanism& mechanism, const Pose& pose, Matrix6* hessian) {
  const double weight = mechanism.mass_kg * mechanism.gravity_m_s2;
  const Eigen::Vector3d s = pose.rotation * mechanism.center_of_mass, up = Eigen::Vector3d::UnitZ();
  PotentialTerm term;
  term.energy_J = weight * (pose.translation.z() + s.z());
  term.gradient << weight * up, weight * s.cross(up);
  if (hessian) hessian->bottomRightCorner<3, 3>() += weight * turning(s, up);
  return term;
}

double spring_energy(const Mechanism& mechanism, const Springs& springs, const Pose& pose, Vector6* gradient,
                     Matrix6* hessian) {
  if (hessian) hessian->setZero();
  const PotentialTerm gravity = gravity_term(mechanism, pose, hessian);
  double energy = gravity.energy_J;
  if (gradient) *gradient = gravity.gradient;
  for (Eigen::Index i = 0; i < springs.natural_m.size(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    const double k = springs.stiffness_N_m[i];
    const LengthTerm term = cable_length_term(cable, pose);
    const double stretch = term.length_m - springs.natural_m[i];
    if (stretch <= 0) continue;
    energy += 0.5 * k * stretch * stretch;
    if (gradient) *gradient += k * stretch * term.gradient;
    if (hessian) {
      *hessian += k * term.gradient * term.gradient.transpose();
      cable_length_term(cable, pose, k * stretch, hessian);
    }
  }
  return energy;
}

Minimum minimise_energy(const Mechanism& mechanism, const Springs& springs, const Pose& start, double tolerance) {
  const double weight = mechanism.mass_kg * mechanism.gravity_m_s2, length = characteristic_length(mechanism);
  Vector6 scale;  // a radian counts as the way of an attachment point
  scale << 1, 1, 1, 1 / length, 1 / length, 1 / length;
  Minimum result;
  result.pose = start;
  double radius = 0.05;
  Vector6 gradient;
  Matrix6 hessian;
  double energy = spring_energy(mechanism, springs, result.pose, &gradient, &hessian);
  for (; result.iterations < 300; ++result.iterations) {
    const Vector6 g = scale.cwiseProduct(gradient);
    const Eigen::SelfAdjointEigenSolver<Matrix6> b(scale.asDiagonal() * hessian * scale.asDiagonal());
    const bool minimum = b.eigenvalues()[0] > -1e-9 * std::max(weight, b.eigenvalues()[5]);
    if (g.norm() <= tolerance * weight && minimum) {
      result.converged = true;
      break;
    }
    const Vector6 p = trust_region_step(g, b, radius);
    const double predicted =
        -g.dot(p) - 0.5 * p.dot((b.eigenvectors() * b.eigenvalues().asDiagonal() * b.eigenvectors().transpose() * p));
    const Pose next = moved(result.pose, scale.cwiseProduct(p));
    Vector6 next_gradient;
    Matrix6 next_hessian;
    const double next_energy = spring_energy(mechanism, springs, next, &next_gradient, &next_hessian);
    // Where the energy's digits end, the gradient's still tell.
    const bool blind = predicted < 1e-13 * (std::abs(energy) + weight);
    const double ratio =
        blind ? (scale.cwiseProduct(next_gradient).norm() < g.norm() ? 1 : 0) : (energy - next_energy) / predicted;
    if (ratio > 0.75 && p.norm() > 0.9 * radius) radius = std::min(2 * radius, 0.3);
    if (ratio < 0.25) radius = 0.25 * p.norm();
    if (ratio > 1e-4) {
      result.pose = next, energy = next_energy, gradient = next_gradient, hessian = next_hessian;
    } else if (radius < 1e-14) {
      result.converged = minimum && g.norm() <= 1e-6 * weight;
      break;
    }
  }
  return result;
}

}  // namespace lumihull::capture::internal
