// The static test and the crossing test of a cable mechanism, beside plain Eigen on the same poses in the same run.
//
// Peer: W as a fixed 6 x 6 matrix without bounds checks, FullPivLU for rank and solution, torques scaled likewise;
// where a tension is negative and a verdict alone is asked for, it stops there, as ours does. Crossings: the peer's
// are 64 steps with a change of sign, each refined by bisection.
#include <lumihull/capture/clearance.h>
#include <lumihull/capture/forward.h>
#include <lumihull/capture/statics.h>

#include <Eigen/Dense>
#include <cstdio>
#include <ctime>
#include <unsupported/Eigen/NonLinearOptimization>
#include <vector>

#include "../capture/mechanism_support.h"

namespace {

using namespace lumihull;
using namespace lumihull::capture;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Best of five runs, calls a second.
template <class F>
double rate(std::size_t calls, const F& run) {
  double best = 1e300;
  for (int k = 0; k < 5; ++k) {
    const double start = cpu_seconds();
    run();
    best = std::min(best, cpu_seconds() - start);
  }
  return double(calls) / best;
}

Matrix6 peer_wrench(const Mechanism& m, const Pose& pose, double length) {
  Matrix6 w;
  const Eigen::Matrix3d q = pose.rotation.toRotationMatrix();
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d c = q * m.cables[std::size_t(i)].attachment;
    const Eigen::Vector3d u = (m.cables[std::size_t(i)].departure - pose.translation - c).normalized();
    w.col(i).head<3>() = u;
    w.col(i).tail<3>() = c.cross(u) / length;
  }
  return w;
}

Vector6 load(const Mechanism& m, const Pose& pose, double length) {
  const Eigen::Vector3d force(0, 0, m.mass_kg * m.gravity_m_s2);
  Vector6 f;
  f.head<3>() = force;
  f.tail<3>() = (pose.rotation * m.center_of_mass).cross(force) / length;
  return f;
}

Balance verdict(const Mechanism& m, const Vector6& t) {
  if (!(t.minCoeff() >= -1e-9 * m.mass_kg * m.gravity_m_s2)) return Balance::unbalanced;
  for (int i = 0; i < 6; ++i)
    if (t[i] < m.cables[std::size_t(i)].min_tension_N || t[i] > m.cables[std::size_t(i)].max_tension_N)
      return Balance::loose;
  return Balance::controlled;
}

template <class Solver>
Balance peer_test(const Mechanism& m, const Pose& pose, double length) {
  const Solver lu(peer_wrench(m, pose, length));
  if constexpr (requires { lu.isInvertible(); })
    if (!lu.isInvertible()) return Balance::singular;
  return verdict(m, lu.solve(load(m, pose, length)));
}

}  // namespace

int main() {
  const Mechanism mechanism = paper_mechanism();
  const double length = characteristic_length(mechanism);
  test::Random random(1);
  std::vector<Pose> poses;
  for (int i = 0; i < 100000; ++i) {
    Pose pose = test::pose_on_hemisphere(random.uniform(0, 6.283), random.uniform(0, 1.571), random.uniform(1, 2.5));
    if (i % 2) pose.rotation = random.rotation(1) * pose.rotation;  // half of them in no order
    poses.push_back(pose);
  }
  const std::size_t n = poses.size();
  std::vector<Balance> ours(n), full(n), partial(n);

  std::printf("%-46s %12s  %s\n", "static test, six cables, one core", "poses/s", "accuracy");
  const double own = rate(n, [&] {
    for (std::size_t i = 0; i < n; ++i) ours[i] = static_test(mechanism, poses[i]);
  });
  const double peer_full = rate(n, [&] {
    for (std::size_t i = 0; i < n; ++i) full[i] = peer_test<Eigen::FullPivLU<Matrix6>>(mechanism, poses[i], length);
  });
  const double peer_partial = rate(n, [&] {
    for (std::size_t i = 0; i < n; ++i)
      partial[i] = peer_test<Eigen::PartialPivLU<Matrix6>>(mechanism, poses[i], length);
  });
  std::size_t counts[4] = {}, other_full = 0, other_partial = 0;
  for (std::size_t i = 0; i < n; ++i)
    ++counts[int(ours[i])], other_full += ours[i] != full[i], other_partial += ours[i] != partial[i];
  std::printf("%-46s %12.0f  controlled %zu, loose %zu, singular %zu, unbalanced %zu\n", "static_test", own, counts[0],
              counts[1], counts[2], counts[3]);
  std::printf("%-46s %12.0f  %zu verdicts differ\n", "Eigen FullPivLU", peer_full, other_full);
  std::printf("%-46s %12.0f  %zu verdicts differ (judges no rank)\n", "Eigen PartialPivLU", peer_partial,
              other_partial);

  double residual = 0, peer_residual = 0;
  const double tension_rate = rate(n, [&] {
    residual = 0;
    for (const Pose& pose : poses) {
      const Tensions t = tensions(mechanism, pose);
      if (t.balance != Balance::unbalanced) residual = std::max(residual, t.residual_N);
    }
  });
  const double svd_rate = rate(n, [&] {
    peer_residual = 0;
    for (const Pose& pose : poses) {
      const Matrix6 w = peer_wrench(mechanism, pose, length);
      const Eigen::JacobiSVD<Matrix6, Eigen::NoQRPreconditioner> svd(w, Eigen::ComputeFullU | Eigen::ComputeFullV);
      const Vector6 f = load(mechanism, pose, length), t = svd.solve(f);
      if (t.minCoeff() >= 0 && svd.singularValues()[5] > 1e-8)
        peer_residual = std::max(peer_residual, (w * t - f).norm());
    }
  });
  std::printf("%-46s %12.0f  largest residual %.1e N\n", "tensions (with least singular value, NNLS)", tension_rate,
              residual);
  std::printf("%-46s %12.0f  largest residual %.1e N\n", "Eigen JacobiSVD (no NNLS where unbalanced)", svd_rate,
              peer_residual);
  for (const int cables : {7, 8, 12}) {
    const Mechanism more = test::random_mechanism(random, cables);
    const std::size_t some = 5000;
    std::size_t controlled = 0;
    const double r = rate(some, [&] {
      controlled = 0;
      for (std::size_t i = 0; i < some; ++i) controlled += tensions(more, poses[i]).balance == Balance::controlled;
    });
    std::printf("tensions, %2d cables %27s %12.0f  controlled %zu of %zu\n", cables, "", r, controlled, some);
  }

  // Steps of a scan: neighbours on the hemisphere, 10 degrees apart.
  std::vector<std::pair<Pose, Pose>> steps;
  for (int i = 0; i < 100000; ++i) {
    const double theta = random.uniform(0, 6.283), phi = random.uniform(0, 1.4);
    steps.push_back({test::pose_on_hemisphere(theta, phi), i % 2 ? test::pose_on_hemisphere(theta, phi + 0.17)
                                                                 : test::pose_on_hemisphere(theta + 0.17, phi)});
  }
  Mechanism crossed = mechanism;  // one that does cross
  std::swap(crossed.cables[0].departure, crossed.cables[3].departure);
  for (const auto& [name, m] : {std::pair<const char*, const Mechanism*>{"paper's mechanism", &mechanism},
                                {"two cables exchanged", &crossed}}) {
    std::size_t found = 0;
    const double alone = rate(steps.size(), [&] {
      found = 0;
      for (const auto& [from, to] : steps) found += first_crossing(*m, from, to).has_value();
    });
    const double both = rate(steps.size(), [&] {
      found = 0;
      for (const auto& [from, to] : steps) {
        if (static_test(*m, to) != Balance::controlled) ++found;
        found += first_crossing(*m, from, to).has_value();
      }
    });
    std::printf("%-20s first_crossing %10.0f steps/s, %.0f ns a pair; with static_test %10.0f poses/s (%zu)\n", name,
                alone, 1e9 / alone / 12, both, found);
  }
  const double clear = rate(n, [&] {
    double least = 1;
    const KeepOut object{{0, 0, -1}, 0.3, 1.2};
    for (const Pose& pose : poses) least = std::min(least, clearance(mechanism, pose, &object).cable_cable);
    if (least > 1e9) std::puts("?");
  });
  std::printf("clearance with an object: %.0f poses/s\n", clear);

  // Forward kinematics from 0.1 m and 0.1 rad away, beside Eigen's Powell hybrid on the same equations.
  struct Lengths {
    const Mechanism* m;
    Eigen::VectorXd wanted;
    Pose start;
    int inputs() const { return 6; }
    int values() const { return 6; }
    Pose pose(const Eigen::VectorXd& x) const {
      const Eigen::Vector3d turn = x.tail<3>();
      const Eigen::Quaterniond q(Eigen::AngleAxisd(
          turn.norm(), turn.norm() > 0 ? Eigen::Vector3d(turn.normalized()) : Eigen::Vector3d::UnitX()));
      return {q * start.rotation, start.translation + x.head<3>()};
    }
    int operator()(const Eigen::VectorXd& x, Eigen::VectorXd& f) const {
      f = cable_lengths(*m, pose(x)) - wanted;
      return 0;
    }
  };
  const std::size_t starts = 10000;
  std::vector<Pose> goals, from;
  for (std::size_t i = 0; i < starts; ++i) {
    goals.push_back(test::pose_on_hemisphere(random.uniform(0, 6.283), random.uniform(0, 1.571)));
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1, random.direction()));
    from.push_back({turn * goals[i].rotation, goals[i].translation + 0.1 * random.direction()});
  }
  double worst = 0, peer_worst = 0;
  const double forward = rate(starts, [&] {
    worst = 0;
    for (std::size_t i = 0; i < starts; ++i) {
      const CableVector l = cable_lengths(mechanism, goals[i]);
      const Hanging h = hang_rigid(mechanism, {l.data(), std::size_t(l.size())}, from[i]);
      worst = std::max(worst, (h.world_from_platform.translation - goals[i].translation).norm());
    }
  });
  const double hybrid = rate(starts, [&] {
    peer_worst = 0;
    for (std::size_t i = 0; i < starts; ++i) {
      Lengths f{&mechanism, cable_lengths(mechanism, goals[i]), from[i]};
      Eigen::HybridNonLinearSolver<Lengths> solver(f);
      solver.parameters.xtol = 1e-13;
      Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
      solver.solveNumericalDiff(x);
      peer_worst = std::max(peer_worst, (f.pose(x).translation - goals[i].translation).norm());
    }
  });
  std::printf("hang_rigid %.0f/s, worst %.1e m; Eigen's Powell hybrid (no tensions) %.0f/s, worst %.1e m\n", forward,
              worst, hybrid, peer_worst);
}
