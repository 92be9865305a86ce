// Forward kinematics: where the platform hangs for given cables.
#include <lumihull/base/error.h>
#include <lumihull/capture/forward.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <optional>
#include <string>

#include "energy.h"
#include "geometry.h"

namespace lumihull::capture {
namespace {

using internal::Matrix6;
using internal::Springs;
using internal::Vector6;

constexpr double kLengthsMet_m = 1e-11;

CableVector need_lengths(const Mechanism& mechanism, std::span<const double> lengths, const Pose& start) {
  internal::need_usable(mechanism, start);
  if (lengths.size() != mechanism.cables.size())
    throw Error(ErrorCode::invalid_argument, "expected a length for each of " +
                                                 std::to_string(mechanism.cables.size()) + " cables, not " +
                                                 std::to_string(lengths.size()));
  for (std::size_t i = 0; i < lengths.size(); ++i)
    if (!(lengths[i] > 0) || !std::isfinite(lengths[i]))
      throw Error(ErrorCode::invalid_argument, "expected a positive length", "cable " + mechanism.cables[i].name);
  return CableVector::Map(lengths.data(), Eigen::Index(lengths.size()));
}

/// Newton's method on six lengths; nullopt where it leaves the start's surroundings or does not settle.
std::optional<Pose> meet_six_lengths(const Mechanism& mechanism, const CableVector& lengths, const Pose& start,
                                     int* iterations) {
  Pose pose = start;
  const double size = characteristic_length(mechanism);
  double before = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 30; ++i) {
    const Vector6 excess = cable_lengths(mechanism, pose) - lengths;
    const double now = excess.cwiseAbs().maxCoeff();
    if (now < kLengthsMet_m && !(now < 0.5 * before)) return pose;  // until rounding stops it
    if (i > 8 && !(now < before) && now > kLengthsMet_m) return std::nullopt;
    before = now;
    const Eigen::PartialPivLU<Matrix6> lu(Matrix6(wrench_matrix(mechanism, pose).transpose()));
    Vector6 twist = lu.solve(excess);
    if (!twist.allFinite()) return std::nullopt;
    const double far = std::max(twist.head<3>().norm(), size * twist.tail<3>().norm());
    if (far > 0.2) twist *= 0.2 / far;
    pose = internal::moved(pose, twist);
    ++*iterations;
  }
  return std::nullopt;
}

/// Newton's method on what holds at the least height: gradient + sum λ ∇l = 0, l = l* for the cables in `taut`.
/// false where it does not settle to multipliers >= 0 with no other cable too long.
bool polish(const Mechanism& mechanism, const CableVector& lengths, Pose* pose, CableVector* tension, int* iterations) {
  const double weight = mechanism.mass_kg * mechanism.gravity_m_s2;
  std::vector<int> taut;
  for (Eigen::Index i = 0; i < tension->size(); ++i)
    if ((*tension)[i] > 1e-6 * weight) taut.push_back(int(i));
  const Eigen::Index count = Eigen::Index(taut.size());
  Pose at = *pose;
  CableVector t = *tension;
  for (int round = 0; round < 20; ++round) {
    Matrix6 hessian = Matrix6::Zero();
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(6 + count, 6 + count);
    Eigen::VectorXd right(6 + count);
    right.head<6>() = -internal::gravity_term(mechanism, at, &hessian).gradient;
    for (Eigen::Index k = 0; k < count; ++k) {
      const int i = taut[std::size_t(k)];
      const auto term = internal::cable_length_term(mechanism.cables[std::size_t(i)], at, t[i], &hessian);
      system.block<6, 1>(0, 6 + k) = term.gradient;
      system.block<1, 6>(6 + k, 0) = term.gradient.transpose();
      right[6 + k] = lengths[i] - term.length_m;
    }
    system.topLeftCorner<6, 6>() = hessian;
    // Redundant cables leave tensions undetermined: the answer of least norm.
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(system);
    const Eigen::VectorXd x = solver.solve(right);
    if (!x.allFinite() || x.head<6>().norm() > 0.1) return false;
    for (Eigen::Index k = 0; k < count; ++k) t[taut[std::size_t(k)]] = x[6 + k];
    at = internal::moved(at, x.head<6>());
    ++*iterations;
    if (x.head<6>().norm() < 1e-12) {
      const CableVector now = cable_lengths(mechanism, at);
      for (Eigen::Index i = 0; i < now.size(); ++i)
        if (now[i] > lengths[i] + 1e-9) return false;
      for (const int i : taut)
        if (!(t[i] >= -1e-9 * weight)) return false;
      for (Eigen::Index i = 0; i < t.size(); ++i) t[i] = std::max(0.0, t[i]);
      std::vector<bool> kept(std::size_t(t.size()));
      for (const int i : taut) kept[std::size_t(i)] = true;
      for (Eigen::Index i = 0; i < t.size(); ++i)
        if (!kept[std::size_t(i)]) t[i] = 0;
      *pose = at, *tension = t;
      return true;
    }
  }
  return false;
}

/// The least height subject to l <= l*: Powell's and Hestenes' multipliers on springs that shorten by λ / k.
Hanging hang_lowest(const Mechanism& mechanism, const CableVector& lengths, const Pose& start) {
  const double weight = mechanism.mass_kg * mechanism.gravity_m_s2;
  const Eigen::Index n = lengths.size();
  Springs springs{lengths, CableVector::Constant(n, 100 * weight)};
  Hanging result;
  result.world_from_platform = start;
  CableVector tension = CableVector::Zero(n);
  double worst = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 60; ++round) {
    const internal::Minimum minimum =
        internal::minimise_energy(mechanism, springs, result.world_from_platform, round < 3 ? 1e-5 : 1e-10);
    result.world_from_platform = minimum.pose;
    result.iterations += minimum.iterations;
    const CableVector excess = cable_lengths(mechanism, minimum.pose) - lengths;
    for (Eigen::Index i = 0; i < n; ++i) tension[i] = std::max(0.0, tension[i] + springs.stiffness_N_m[i] * excess[i]);
    const double violation = excess.maxCoeff();
    if (minimum.converged && violation < 1e-3) {
      Pose pose = minimum.pose;
      CableVector polished = tension;
      if (polish(mechanism, lengths, &pose, &polished, &result.iterations)) {
        result.world_from_platform = pose;
        result.tension_N = polished;
        result.taut = polished.minCoeff() > 0;
        return result;
      }
    }
    if (violation > 0.25 * worst) springs.stiffness_N_m = (4 * springs.stiffness_N_m).cwiseMin(1e7 * weight);
    worst = std::max(violation, 0.0);
    springs.natural_m = lengths - tension.cwiseQuotient(springs.stiffness_N_m);
  }
  throw Error(ErrorCode::degenerate, "no stable pose near the start satisfies these cable lengths", mechanism.name);
}

}  // namespace

Hanging hang_rigid(const Mechanism& mechanism, std::span<const double> lengths_m, const Pose& start) {
  const CableVector lengths = need_lengths(mechanism, lengths_m, start);
  Hanging result;
  if (lengths.size() == 6) {
    if (const auto pose = meet_six_lengths(mechanism, lengths, start, &result.iterations)) {
      const Tensions held = tensions(mechanism, *pose);
      if (held.balance == Balance::controlled || held.balance == Balance::loose) {
        result.world_from_platform = *pose;
        result.tension_N = held.tension_N;
        result.taut = held.tension_N.minCoeff() > 0;
        return result;
      }
    }
  }
  return hang_lowest(mechanism, lengths, start);
}

Hanging hang_elastic(const Mechanism& mechanism, std::span<const double> unstrained_m, const Pose& start) {
  Springs springs;
  springs.natural_m = need_lengths(mechanism, unstrained_m, start);
  springs.stiffness_N_m.resize(springs.natural_m.size());
  for (Eigen::Index i = 0; i < springs.natural_m.size(); ++i) {
    const Cable& cable = mechanism.cables[std::size_t(i)];
    if (!(cable.stiffness_N > 0))
      throw Error(ErrorCode::invalid_argument, "expected stiffness_N > 0", "cable " + cable.name);
    springs.stiffness_N_m[i] = cable.stiffness_N / springs.natural_m[i];
  }
  const internal::Minimum minimum = internal::minimise_energy(mechanism, springs, start, 1e-10);
  if (!minimum.converged) throw Error(ErrorCode::degenerate, "no equilibrium was found near the start", mechanism.name);
  Hanging result;
  result.world_from_platform = minimum.pose;
  result.iterations = minimum.iterations;
  result.tension_N = (cable_lengths(mechanism, minimum.pose) - springs.natural_m).cwiseMax(0);
  result.taut = result.tension_N.minCoeff() > 0;
  result.tension_N = result.tension_N.cwiseProduct(springs.stiffness_N_m);
  return result;
}

CableVector unstrained_lengths(const Mechanism& mechanism, const Pose& world_from_platform) {
  const Tensions held = tensions(mechanism, world_from_platform);
  if (held.balance == Balance::unbalanced)
    throw Error(ErrorCode::degenerate, "no tensions hold the platform at this pose", mechanism.name);
  CableVector lengths = cable_lengths(mechanism, world_from_platform);
  for (Eigen::Index i = 0; i < lengths.size(); ++i)
    if (const double ea = mechanism.cables[std::size_t(i)].stiffness_N; ea > 0)
      lengths[i] /= 1 + held.tension_N[i] / ea;
  return lengths;
}

}  // namespace lumihull::capture
