// Cables that sag under their own weight.
#include <lumihull/base/error.h>
#include <lumihull/capture/sag.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "geometry.h"

namespace lumihull::capture {
namespace {

constexpr int kSteps = 200;

void need(bool holds, const char* expected) {
  if (!holds) throw Error(ErrorCode::invalid_argument, std::string("expected ") + expected, "cable");
}

void need_kind(const CableKind& kind, double along_m, double rise_m) {
  need(kind.weight_N_m >= 0 && std::isfinite(kind.weight_N_m), "weight_N_m of at least 0");
  need(kind.stiffness_N >= 0 && std::isfinite(kind.stiffness_N), "stiffness_N of at least 0");
  need(along_m > internal::kShortest_m && std::isfinite(along_m), "a horizontal distance of more than 1 µm");
  need(std::isfinite(rise_m), "a finite rise");
}

/// T + V without cancellation where V is negative.
double tension_plus(double h, double v, double t) { return v >= 0 ? t + v : h * h / (t - v); }

}  // namespace

double HangingCable::tension_N() const { return std::hypot(pull_N, lift_N); }

Eigen::Vector2d cable_end(const CableKind& kind, const HangingCable& cable, Eigen::Matrix<double, 2, 3>* jacobian) {
  const double h = cable.pull_N, v = cable.lift_N, length = cable.length_m, w = kind.weight_N_m;
  const double give = kind.stiffness_N > 0 ? 1 / kind.stiffness_N : 0;
  const double v1 = v + w * length, t = std::hypot(h, v), t1 = std::hypot(h, v1);
  // The differences of asinh and of tensions, divided by w, in forms that keep their digits for a light cable:
  // asinh(V1 / H) - asinh(V / H) = log((V1 + T1) / (V + T)) = log(1 + w L q), T1 - T = w L (V1 + V) / (T1 + T).
  const double plus = tension_plus(h, v, t), plus1 = tension_plus(h, v1, t1);
  const double q = (plus1 + plus) / ((t1 + t) * plus);
  const double y = w * length * q;
  const double spread = length * q * (y > 0 ? std::log1p(y) / y : 1);  // (asinh - asinh) / w
  const double x = h * (length * give + spread);
  const double z = (v + 0.5 * w * length) * length * give + length * (v1 + v) / (t1 + t);
  if (jacobian) {
    // By the integral over the cable of d(T / |T|)/dF: x = ∫ H/T ds, z = ∫ V(s)/T ds; ∫ ds / T = spread.
    // (V1/T1 - V/T) / w and (1/T - 1/T1) / w again without cancellation.
    const double mixed = length * (v1 + v) / ((t1 + t) * t * t1);  // (1/T - 1/T1) / w
    // V1/T1 - V/T = (V1 T - V T1) / (T T1); with D = V1 - V = w L: V1 T - V T1 = D T - V (T1 - T).
    const double sine = length * (t - v * (v1 + v) / (t1 + t)) / (t * t1);  // (V1/T1 - V/T) / w = ∫ H² / T³ ds
    // dx/dH = L/EA + ∫ V²/T³ = L/EA + ∫ 1/T - ∫ H²/T³; dz/dV = L/EA + ∫ H²/T³; dx/dV = dz/dH = -H ∫ V/T³.
    (*jacobian)(0, 0) = length * give + spread - sine;
    (*jacobian)(0, 1) = (*jacobian)(1, 0) = -h * mixed;
    (*jacobian)(1, 1) = length * give + sine;
    (*jacobian)(0, 2) = h * give + h / t1;
    (*jacobian)(1, 2) = v1 * give + v1 / t1;
  }
  return {x, z};
}

HangingCable cable_of_tension(const CableKind& kind, double along_m, double rise_m, double tension_N) {
  need_kind(kind, along_m, rise_m);
  need(tension_N > 0 && std::isfinite(tension_N), "a positive tension");
  const double chord = std::hypot(along_m, rise_m), w = kind.weight_N_m;
  // Unknown: the angle of the pull at the platform and the length. Start: a shallow parabola's.
  double angle = std::atan2(rise_m, along_m) - std::min(0.5 * w * along_m / tension_N, 1.2), length = chord;
  const auto at = [&](double a, double l, Eigen::Matrix<double, 2, 3>* jacobian) {
    const HangingCable cable{l, tension_N * std::cos(a), tension_N * std::sin(a)};
    return Eigen::Vector2d(cable_end(kind, cable, jacobian) - Eigen::Vector2d(along_m, rise_m));
  };
  Eigen::Matrix<double, 2, 3> j;
  Eigen::Vector2d miss = at(angle, length, &j);
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix2d by;
    by.col(0) = tension_N * (j.col(1) * std::cos(angle) - j.col(0) * std::sin(angle));
    by.col(1) = j.col(2);
    const Eigen::Vector2d change = by.partialPivLu().solve(-miss);
    if (!change.allFinite()) break;
    double factor = 1;
    for (; factor > 1e-10; factor *= 0.5) {
      const double a = angle + factor * change[0], l = length + factor * change[1];
      if (!(std::abs(a) < 0.5 * std::numbers::pi - 1e-9) || !(l > 0)) continue;
      Eigen::Matrix<double, 2, 3> next_j;
      const Eigen::Vector2d next = at(a, l, &next_j);
      if (next.norm() < miss.norm() || next.norm() < 1e-13 * chord) {
        angle = a, length = l, miss = next, j = next_j;
        break;
      }
    }
    if (miss.norm() < 1e-13 * chord || factor <= 1e-10) break;
  }
  // The two cables of one tension meet where it is least, at det d(x, z) / d(angle, L0) = 0; the tauter one, like a
  // straight cable, has det < 0.
  const Eigen::Vector2d turn = tension_N * (j.col(1) * std::cos(angle) - j.col(0) * std::sin(angle));
  if (!(miss.norm() < 1e-10 * chord) || !(turn.x() * j(1, 2) - turn.y() * j(0, 2) < 0))
    throw Error(ErrorCode::degenerate, "the cable's own weight needs more tension at the platform", "cable");
  return {length, tension_N * std::cos(angle), tension_N * std::sin(angle)};
}

HangingCable cable_of_length(const CableKind& kind, double along_m, double rise_m, double length_m) {
  need_kind(kind, along_m, rise_m);
  need(length_m > 0 && std::isfinite(length_m), "a positive length");
  const double chord = std::hypot(along_m, rise_m), w = kind.weight_N_m, ea = kind.stiffness_N;
  if (ea == 0 && length_m <= chord)
    throw Error(ErrorCode::degenerate, "a cable that does not stretch is too short to reach", "cable");
  if (w == 0 && length_m >= chord)
    throw Error(ErrorCode::degenerate, "a slack cable without weight hangs anyhow", "cable");
  // d(x, z)/d(H, V) is the second derivative of the complementary energy, a convex function of the force: Newton's
  // method with backtracking on that function's gradient finds its one minimum.
  HangingCable cable{length_m, 0, 0};
  if (length_m > chord * (1 + 1e-9) && w > 0) {  // Start: Peyrot & Goulois 1979
    const double ratio = (length_m * length_m - rise_m * rise_m) / (along_m * along_m) - 1;
    const double lambda = std::clamp(std::sqrt(std::max(3 * ratio, 1e-12)), 1e-6, 20.0);
    cable.pull_N = w * along_m / (2 * lambda);
    cable.lift_N = 0.5 * w * (rise_m / std::tanh(lambda) - length_m);
  } else {
    const double tension = std::max(ea * (chord / length_m - 1), 1e-3 * w * length_m);
    cable.pull_N = tension * along_m / chord;
    cable.lift_N = tension * rise_m / chord - 0.5 * w * length_m;
  }
  const Eigen::Vector2d goal(along_m, rise_m);
  Eigen::Matrix<double, 2, 3> j;
  Eigen::Vector2d miss = cable_end(kind, cable, &j) - goal;
  for (int step = 0; step < kSteps && !(miss.norm() < 1e-14 * chord); ++step) {
    const Eigen::Vector2d change = j.leftCols<2>().partialPivLu().solve(-miss);
    if (!change.allFinite()) break;
    double factor = 1;
    for (; factor > 1e-10; factor *= 0.5) {
      HangingCable next = cable;
      next.pull_N += factor * change[0], next.lift_N += factor * change[1];
      if (!(next.pull_N > 0)) continue;
      Eigen::Matrix<double, 2, 3> next_j;
      const Eigen::Vector2d next_miss = cable_end(kind, next, &next_j) - goal;
      if (next_miss.norm() < miss.norm()) {
        cable = next, miss = next_miss, j = next_j;
        break;
      }
    }
    if (factor <= 1e-10) break;
  }
  if (!(miss.norm() < 1e-9 * chord))
    throw Error(ErrorCode::degenerate, "no catenary was found between these ends", "cable");
  return cable;
}

std::vector<HangingCable> sagging_cables(const Mechanism& mechanism, const Pose& world_from_platform) {
  const Tensions straight = tensions(mechanism, world_from_platform);
  if (mechanism.cables.size() != 6)
    throw Error(ErrorCode::unsupported, "sagging cables are computed for mechanisms of six", mechanism.name);
  if (straight.balance != Balance::controlled && straight.balance != Balance::loose)
    throw Error(ErrorCode::degenerate, "no tensions hold the platform at this pose", mechanism.name);
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  const Eigen::Matrix3d q = world_from_platform.rotation.toRotationMatrix();
  const Eigen::Vector3d weight(0, 0, mechanism.mass_kg * mechanism.gravity_m_s2);
  Vector6 load, tension = straight.tension_N;
  load << weight, (q * mechanism.center_of_mass).cross(weight);
  std::vector<HangingCable> cables(6);
  // The pull's direction hardly changes with the tension: directions, then tensions, until both stay.
  for (int round = 0; round < 100; ++round) {
    Matrix6 w;
    for (int i = 0; i < 6; ++i) {
      const Cable& cable = mechanism.cables[std::size_t(i)];
      const Eigen::Vector3d c = q * cable.attachment, d = cable.departure - world_from_platform.translation - c;
      const double along = d.head<2>().norm();
      try {
        cables[std::size_t(i)] = cable_of_tension({cable.density_kg_m * mechanism.gravity_m_s2, cable.stiffness_N},
                                                  along, d.z(), tension[i]);
      } catch (const Error& error) {
        throw Error(ErrorCode::degenerate, error.message(), "cable " + cable.name);
      }
      const HangingCable& hanging = cables[std::size_t(i)];
      const Eigen::Vector3d pull(hanging.pull_N * d.x() / along, hanging.pull_N * d.y() / along, hanging.lift_N);
      w.col(i) << pull / tension[i], c.cross(pull / tension[i]);
    }
    const Vector6 next = w.partialPivLu().solve(load);
    const double change = (next - tension).cwiseAbs().maxCoeff();
    tension = next;
    if (!(tension.minCoeff() > 0) || !tension.allFinite()) break;
    if (change < 1e-10 * weight.z()) return cables;
  }
  throw Error(ErrorCode::degenerate, "no positive tensions hold the platform when its cables sag", mechanism.name);
}

}  // namespace lumihull::capture
